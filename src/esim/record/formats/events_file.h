#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include "esim/record/formats/events_hdf5.h"
#include "esim/record/formats/events_text.h"

namespace esim {

/// Width and height of a sensor, px.
struct SensorSize {
  int width = 0, height = 0;
};

/// Events of one camera from any file that esim reads, portion by portion: HDF5 in DSEC's layout or lines `t x y p`,
/// told apart by content. A folder stands for the events.h5, or else the events.txt, of the recording in it.
///
/// Every event that is handed out is on the sensor, as far as its size is known, and not before the one above it;
/// anything else is a UserError with file, index and values.
class EventsFile {
 public:
  /// `sensor` replaces what the file or its recording says. Throws UserError if there is nothing to read, or if the
  /// folder holds several cameras.
  explicit EventsFile(const std::filesystem::path& path, std::optional<SensorSize> sensor = std::nullopt);

  const std::filesystem::path& path() const { return path_; }  ///< of the file itself
  std::optional<SensorSize> sensor() const { return sensor_; }

  /// Replaces `events` by the next ones, at most `count`; false if there are none left.
  bool read(std::vector<Event>& events, std::size_t count);

 private:
  using Reader = std::variant<EventsHdf5Reader, EventsTextReader>;
  static Reader open(const std::filesystem::path& path);
  void check(const std::vector<Event>& events);

  std::filesystem::path path_;
  Reader reader_;
  std::optional<SensorSize> sensor_;
  std::uint64_t done_ = 0;  // events read
  std::optional<TimeNs> last_t_;
};

}  // namespace esim

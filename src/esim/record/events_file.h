#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "esim/record/format.h"

namespace esim {

/// Events of one camera from a file of any format, portion by portion, as open_source() gives them. A folder stands for
/// the events.h5, or else the events.txt, of the recording in it.
class EventsFile {
 public:
  /// Throws UserError if there is nothing to read, or if there are several cameras.
  explicit EventsFile(const std::filesystem::path& path, const ReadOptions& options = {});

  const std::filesystem::path& path() const { return path_; }  ///< of the file itself
  std::optional<SensorSize> sensor() const { return sensor_; }

  /// Replaces `events` by the next ones, at most `count`; false if there are none left. Throws UserError where there
  /// are none at all in a file that holds things of unknown kinds.
  bool read(std::vector<Event>& events, std::size_t count);

 private:
  std::filesystem::path path_;
  std::unique_ptr<Source> source_;
  std::optional<SensorSize> sensor_;
  EventSpan portion_;  // of the source's, what has not been read
  bool found_any_ = false;
};

}  // namespace esim

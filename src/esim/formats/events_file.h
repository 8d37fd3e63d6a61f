#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Reads the events of one camera from a file of any format, in portions, through open_source(). A folder stands for
/// the events.h5, or else the events.txt, of the recording in it.
class EventsFile {
 public:
  /// Throws UserError if there are no events to read, or several cameras.
  explicit EventsFile(const std::filesystem::path& path, const ReadOptions& options = {});

  const std::filesystem::path& path() const { return path_; }  ///< path of the events file
  std::optional<SensorSize> sensor() const { return sensor_; }
  double progress() const { return source_->progress(); }  ///< fraction of the file that has been read, 0 to 1

  /// Replaces `events` by the next ones, at most `count`; returns false at the end. Throws UserError if a file with
  /// unsupported contents has no events at all.
  bool read(std::vector<Event>& events, std::size_t count);

 private:
  std::filesystem::path path_;
  std::unique_ptr<Source> source_;
  std::optional<SensorSize> sensor_;
  EventSpan portion_;  // part of the last record that has not been read yet
  bool found_any_ = false;
};

}  // namespace esim::inline formats

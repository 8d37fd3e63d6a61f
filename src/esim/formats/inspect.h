#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/recording/format.h"

namespace esim::inline formats {

enum class RecordingStatus {
  complete,
  interrupted,  ///< ended early by request
  killed,       ///< its process has ended, and the last data may be missing
  running,      ///< its process is still writing
  unknown,      ///< the files do not state it
};

/// Properties of one stream of events.
struct EventsSummary {
  std::string camera;                ///< folder in the recording; empty for a file, or for the folder itself
  std::optional<int> width, height;  ///< px
  std::uint64_t events = 0, on = 0;
  TimeNs first = 0, last = 0;  ///< times of the first and last event; undefined if there are no events
  std::string problem;         ///< why the file cannot be read; empty: no problem

  std::uint64_t off() const { return events - on; }
  /// Events per second between the first and the last; 0 if their times are equal.
  double mean_rate_hz() const;
};

struct FileSize {
  std::filesystem::path name;  ///< relative to the recording
  std::uint64_t bytes = 0;
  std::uint64_t files = 1;  ///< larger for a folder
};

/// The result of `esim info PATH` for a recording, complete or not, or for one file of any format.
struct Inspection {
  std::filesystem::path path;  ///< the inspected path: X.incomplete if X does not exist
  RecordingStatus status = RecordingStatus::unknown;
  std::string reason;  ///< from the report
  std::string format;  ///< of a file
  std::vector<EventsSummary> cameras;
  std::map<Content, std::uint64_t> others;  ///< number of other records in a file
  std::vector<std::string> not_read;        ///< unsupported contents of a file, as text
  std::vector<FileSize> files;
};

/// Reads all events, in memory that does not depend on their number. Throws UserError if PATH does not exist, is not a
/// recording, or is a file that cannot be read.
Inspection inspect(const std::filesystem::path& path);

/// Several lines of plain text, with aligned columns.
std::string describe(const Inspection& inspection);

}  // namespace esim::inline formats

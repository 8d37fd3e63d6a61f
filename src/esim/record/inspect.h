#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/record/format.h"

namespace esim {

enum class RecordingStatus {
  complete,
  interrupted,  ///< ended early, in order
  killed,       ///< its process is gone, and what it wrote last may be missing
  running,      ///< its process is writing now
  unknown,      ///< the files do not say
};

/// What one stream of events holds.
struct EventsSummary {
  std::string camera;                ///< the folder in the recording; empty for a file, or the folder itself
  std::optional<int> width, height;  ///< px
  std::uint64_t events = 0, on = 0;
  TimeNs first = 0, last = 0;  ///< of the events; meaningless if there are none
  std::string problem;         ///< why the file cannot be read; empty: it can

  std::uint64_t off() const { return events - on; }
  /// Events per second between the first and the last; 0 if that is no time at all.
  double mean_rate_hz() const;
};

struct FileSize {
  std::filesystem::path name;  ///< relative to the recording
  std::uint64_t bytes = 0;
  std::uint64_t files = 1;  ///< more for a folder
};

/// What `esim info PATH` tells about a recording, whole or not, or about one file of any format.
struct Inspection {
  std::filesystem::path path;  ///< what was looked at: X.incomplete if there is no X
  RecordingStatus status = RecordingStatus::unknown;
  std::string reason;  ///< as the report has it
  std::string format;  ///< of a file
  std::vector<EventsSummary> cameras;
  std::map<Content, std::uint64_t> others;  ///< what else a file holds: how many
  std::vector<std::string> not_read;        ///< what of a file cannot be read, for people
  std::vector<FileSize> files;
};

/// Reads through the events, in memory that does not depend on their number. Throws UserError if there is nothing to
/// look at, or if PATH is one file that cannot be read.
Inspection inspect(const std::filesystem::path& path);

/// Several lines of plain text, columns aligned.
std::string describe(const Inspection& inspection);

}  // namespace esim

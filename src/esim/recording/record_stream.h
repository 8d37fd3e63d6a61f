#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "esim/recording/format.h"

namespace esim::inline recording {

/// A part of a recording: records in order of time, from a separate file or folder.
class RecordStream {
 public:
  virtual ~RecordStream() = default;

  /// Prepares the next record and returns its time; nothing at the end. Called once before each next().
  virtual std::optional<TimeNs> due() = 0;

  /// The prepared record, borrowed until the next call; of events, those up to `until`. Null if another stream hands it
  /// out as a part of its own record. Both functions throw UserError if the file is damaged from here on.
  virtual const Record* next(TimeNs until) = 0;
};

/// Merges all streams in order of time; at equal times, earlier streams come first. The recording starts at `start` if
/// that is known and before the first record, otherwise with the first record. With `recover`, a stream ends at its
/// damage, and the others continue.
std::unique_ptr<Source> merge_streams(RecordingInfo info, std::vector<std::unique_ptr<RecordStream>> streams,
                                      const ReadOptions& options, std::optional<TimeNs> start = std::nullopt);

}  // namespace esim::inline recording

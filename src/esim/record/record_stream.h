#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "esim/record/format.h"

namespace esim {

/// A part of a recording: records in order of time, from a file or folder of their own.
class RecordStream {
 public:
  virtual ~RecordStream() = default;

  /// Looks for the next record and says its time; nothing where there are none left. Called once before each next().
  virtual std::optional<TimeNs> due() = 0;

  /// That record, borrowed until the next call; of events, those up to `until`. Null where another stream hands it out
  /// as a part of its own record. Both throw UserError where the file is damaged from there on.
  virtual const Record* next(TimeNs until) = 0;
};

/// All streams in one order of time; of records with the same time, those of the earlier streams first. The recording
/// starts at `start`, where that is known and before the first record, and with the first record otherwise. With
/// `recover`, a stream ends where it is damaged, and the others go on.
std::unique_ptr<Source> merge_streams(RecordingInfo info, std::vector<std::unique_ptr<RecordStream>> streams,
                                      const ReadOptions& options, std::optional<TimeNs> start = std::nullopt);

}  // namespace esim

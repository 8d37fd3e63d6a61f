#pragma once

#include <vector>

#include "esim/recording/record.h"
#include "esim/stats/periodicity.h"
#include "esim/stats/stream_sample.h"

namespace esim::inline stats {

/// Measures how the events of a converted video are distributed between its frames: a Sink of the events and the images
/// of camera 0, whose images have the times of the frames.
class BetweenFrames final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override;
  void end(bool) override {}

  /// Tests all events after the first frame and up to the last one, as if the frames were equally spaced. Times are
  /// taken in whole microseconds, as in most files; this determines on which side of a frame its events lie. Unknown if
  /// there are fewer than two frames.
  PhaseTest test() const;

 private:
  TimeSample events_;
  std::vector<TimeNs> frames_;
};

}  // namespace esim::inline stats

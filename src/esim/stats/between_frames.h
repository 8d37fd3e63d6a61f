#pragma once

#include <vector>

#include "esim/record/record.h"
#include "esim/stats/periodicity.h"
#include "esim/stats/time_sample.h"

namespace esim {

/// Watches how the events of a video lie between its frames: a Sink of the events and the images of camera 0, whose
/// images come at the times of the frames.
class BetweenFrames final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override;
  void end(bool) override {}

  /// Of all events after the first frame and up to the last one, as if all frames were equally far apart; of times in
  /// whole microseconds, as most files have them, which decides on which side of a frame its own events are. Unknown
  /// where there are fewer than two frames.
  PhaseTest test() const;

 private:
  TimeSample events_;
  std::vector<TimeNs> frames_;
};

}  // namespace esim

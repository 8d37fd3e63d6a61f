#pragma once

#include <filesystem>
#include <memory>

#include "esim/record/record.h"

namespace esim {

/// preview.mp4, a video of what one camera's events look like beside its ground truth or the video it saw, and
/// preview.png, one frame of it: that with the median number of events among those of the second half. A frame for each
/// frame of ground truth or of the video, played at real time or, if that were too short or too fast to watch, slower
/// as its caption tells.
class PreviewWriter final : public Sink {
 public:
  /// Both files go into `folder`, which must exist.
  PreviewWriter(std::filesystem::path folder, int camera);
  ~PreviewWriter() override;

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// How fast a recording is shown.
struct Playback {
  double frames_per_s = 25;
  int slowdown = 1;  ///< 1, 2 or 5 times a power of ten
};

/// Real time, unless the recording is shorter than 2 s or has more than 60 frames/s; never fewer than 4 frames/s
/// through slowing down.
Playback choose_playback(double duration_s, double truth_rate_hz);

}  // namespace esim

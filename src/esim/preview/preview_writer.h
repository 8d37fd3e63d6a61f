#pragma once

#include <filesystem>
#include <memory>

#include "esim/recording/record.h"

namespace esim::inline preview {

/// Writes preview.mp4 (preview.webp without FFmpeg), a video of one camera's events next to its ground truth or its
/// input video, and preview.png, one frame of it: the one with the median number of events in the second half. The
/// video has one frame per frame of ground truth or input video and plays in real time or, if that were too short or
/// too fast to watch, slower, as its caption states.
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

/// The playback speed of a recording.
struct Playback {
  double frames_per_s = 25;
  int slowdown = 1;  ///< 1, 2 or 5 times a power of ten
};

/// Real time, unless the recording is shorter than 2 s or has more than 60 frames/s; slowed down to no fewer than 4
/// frames/s.
Playback choose_playback(double duration_s, double truth_rate_hz);

}  // namespace esim::inline preview

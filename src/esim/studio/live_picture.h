#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "esim/record/preview/colours.h"
#include "esim/record/record.h"
#include "esim/visualise/event_window.h"

namespace esim::studio {

/// What the first camera of a recording has seen last, while it is made: the events of the last moments over the latest
/// image. Others may look at any time.
class LivePicture {
 public:
  void begin(const RecordingInfo& info);
  void take(const Record& record);

  /// A PNG; empty before the recording has begun.
  std::string png() const;

 private:
  mutable std::mutex mutex_;
  int width_ = 0, height_ = 0;
  EventWindow window_{std::size_t{1} << 20};
  TimeNs now_ = 0;
  Image<float> image_;
};

/// Hands what is recorded to a picture, which outlives it.
class LiveSink final : public Sink {
 public:
  explicit LiveSink(LivePicture& picture) : picture_(picture) {}
  void begin(const RecordingInfo& info) override { picture_.begin(info); }
  void write(const Record& record) override { picture_.take(record); }
  void end(bool) override {}

 private:
  LivePicture& picture_;
};

}  // namespace esim::studio

#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "esim/preview/colours.h"
#include "esim/recording/record.h"
#include "esim/visualise/event_window.h"

namespace esim::studio {

/// The current view of a recording's first camera while it is made: the latest events over the latest image.
/// Thread-safe.
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

/// Forwards records to a picture, which must outlive it.
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

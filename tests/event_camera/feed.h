#pragma once

#include <limits>
#include <vector>

#include "esim/event_camera/event_camera.h"

namespace esim::test {

inline const Workers kOneThread(1);

/// Feeds whole frames to an event camera.
class Feed {
 public:
  Feed(const EventCameraOptions& options, int width, int height, std::uint64_t seed = 0)
      : camera_(options, width, height, seed, 0), image_{0, 0, width, height} {}

  void frame(const Image<float>& frame, TimeNs t, const Workers& workers = kOneThread) {
    feed(frame, t, {image_}, workers);
  }

  /// The same frame, tile by tile.
  void feed(const Image<float>& frame, TimeNs t, const std::vector<Tile>& tiles, const Workers& workers = kOneThread) {
    std::vector<Segment> segments;
    const bool first = last_.empty();
    for (const Tile& tile : tiles) segments.push_back({tile, first ? t : last_t_, t, first ? &frame : &last_, &frame});
    camera_.integrate(segments, t, workers);
    last_ = frame;
    last_t_ = t;
  }

  /// The events up to `until` that have not been returned yet.
  std::vector<Event> events(TimeNs until = std::numeric_limits<TimeNs>::max()) {
    const EventSpan events = camera_.release_until(until);
    return {events.begin(), events.end()};
  }

  const EventCamera& camera() const { return camera_; }

 private:
  EventCamera camera_;
  Tile image_;
  Image<float> last_;
  TimeNs last_t_ = 0;
};

}  // namespace esim::test

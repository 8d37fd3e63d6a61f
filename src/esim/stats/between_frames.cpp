#include "esim/stats/between_frames.h"

#include <algorithm>

namespace esim::inline stats {
namespace {

constexpr TimeNs kEvenInterval = 10 * kNsPerMs;

/// A time stamp in whole microseconds, spread over its microsecond as in test_phase().
TimeNs stored(TimeNs t, std::size_t index) {
  const TimeNs remainder = t % kNsPerUs;
  const TimeNs floored = t - (remainder < 0 ? remainder + kNsPerUs : remainder);
  return floored + static_cast<TimeNs>(hash_index(index) % kNsPerUs);
}

}  // namespace

void BetweenFrames::write(const Record& record) {
  if (const auto* events = std::get_if<EventsRecord>(&record); events != nullptr && events->camera == 0) {
    for (const Event& event : events->events) events_.add(event.t);
  } else if (const auto* image = std::get_if<ImageRecord>(&record); image != nullptr && image->camera == 0) {
    frames_.push_back(image->t);
  }
}

PhaseTest BetweenFrames::test() const {
  if (frames_.size() < 2) return {};
  std::vector<TimeNs> places;
  std::size_t next = 1;  // the frame at or after an event
  for (std::size_t i = 0; i < events_.items().size(); ++i) {
    const TimeNs t = events_.items()[i];
    if (t < frames_.front()) continue;
    while (next < frames_.size() && frames_[next] < t) ++next;
    if (next == frames_.size()) break;
    const TimeNs before = frames_[next - 1], interval = frames_[next] - before;
    const double fraction = static_cast<double>(stored(t, i) - before) / static_cast<double>(interval);
    const double place = (static_cast<double>(next - 1) + fraction) * static_cast<double>(kEvenInterval);
    places.push_back(static_cast<TimeNs>(place));
  }
  return test_phase(places, static_cast<double>(kNsPerSecond) / kEvenInterval);
}

}  // namespace esim::inline stats

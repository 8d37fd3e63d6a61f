#include "esim/sim/flicker_labels.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace esim::inline sim {

FlickerLabels::FlickerLabels(int width, int height, TimeNs start)
    : width_(width), last_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), start) {}

void FlickerLabels::set(const Flicker& flicker, std::span<const Event> events, std::span<EventLabel> labels) {
  const auto log_light = [&](TimeNs t, std::uint16_t object) {
    return std::log(flicker.light().at(t, object) + flicker.dark());
  };
  for (std::size_t i = 0; i < events.size(); ++i) {
    EventLabel& label = labels[i];
    TimeNs& last =
        last_[static_cast<std::size_t>(events[i].y) * static_cast<std::size_t>(width_) + std::size_t{events[i].x}];
    const TimeNs before = std::exchange(last, label.t_ideal);
    const auto change = static_cast<float>(log_light(label.t_ideal, label.object) - log_light(before, label.object));
    label.flicker = std::clamp(change, std::min(label.signal, 0.0F), std::max(label.signal, 0.0F));
    label.signal -= label.flicker;
    if (label.cause == EventCause::signal) label.cause = largest_part(label, events[i].polarity);
  }
}

}  // namespace esim::inline sim

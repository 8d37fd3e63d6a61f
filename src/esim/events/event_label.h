#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "esim/core/describe.h"
#include "esim/core/time.h"

namespace esim::inline events {

/// What made an event: the largest part of its change that has the event's sign.
enum class EventCause : std::uint8_t { signal, flicker, noise, leak };

/// The explanation of one event. The parts are what the change from the pixel's reference to its threshold consists of,
/// ln: their sum is C+ of the pixel for an ON event and -C- for an OFF event (docs/methods/pixel.md).
struct EventLabel {
  TimeNs t_ideal = 0;  ///< of the crossing, before latency and readout
  float signal = 0, flicker = 0, noise = 0, leak = 0;
  std::uint16_t object = 0;          ///< that the pixel saw then: i + 1 for moving object or sprite i, 0: none
  std::uint16_t semantic_class = 0;  ///< of what the pixel saw then; 0: none
  EventCause cause = EventCause::signal;
  std::uint8_t hot = 0;       ///< 1: the pixel is hot
  std::uint16_t padding = 0;  ///< so that equal labels have equal bytes

  friend bool operator==(const EventLabel&, const EventLabel&) = default;
};

/// The labels of consecutive events, in their order.
using LabelSpan = std::span<const EventLabel>;

/// A label when its event happens.
struct NewLabel {
  TimeNs t = 0;        ///< time stamp, before the readout
  TimeNs t_ideal = 0;  ///< of the crossing
  std::uint32_t pixel = 0;
  float signal = 0, noise = 0, leak = 0;
  std::int8_t polarity = 0;
  std::uint8_t is_noise = 0;  ///< 1: noise is the cause, whatever the parts are
  std::array<std::uint8_t, 6> padding{};
};

/// The largest part with the sign of the event.
inline EventCause largest_part(const EventLabel& label, int polarity) {
  const auto sign = static_cast<float>(polarity);
  EventCause cause = EventCause::signal;
  float largest = sign * label.signal;
  const auto compare = [&](float part, EventCause its) {
    if (sign * part > largest) largest = sign * part, cause = its;
  };
  compare(label.flicker, EventCause::flicker);
  compare(label.noise, EventCause::noise);
  compare(label.leak, EventCause::leak);
  return cause;
}

/// Fills a new label, except what the pixel saw.
inline void explain(const NewLabel& event, bool hot, EventLabel& label) {
  label.t_ideal = event.t_ideal;
  label.signal = event.signal, label.noise = event.noise, label.leak = event.leak;
  label.hot = hot ? 1 : 0;
  label.cause = event.is_noise != 0 ? EventCause::noise : largest_part(label, event.polarity);
}

}  // namespace esim::inline events

namespace esim {

template <>
inline constexpr std::array<const char*, 4> kEnumNames<EventCause>{"signal", "flicker", "noise", "leak"};

}  // namespace esim

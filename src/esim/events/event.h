#pragma once

#include <compare>
#include <cstdint>
#include <span>

#include "esim/core/time.h"

namespace esim::inline events {

/// One change of log-brightness reported by one pixel.
struct Event {
  TimeNs t = 0;              ///< time of the threshold crossing, ns
  std::uint16_t x = 0;       ///< column, px
  std::uint16_t y = 0;       ///< row, px
  std::int8_t polarity = 0;  ///< +1: brightness rose, -1: it fell

  /// The canonical order of events: by (t, y, x, polarity).
  friend constexpr std::strong_ordering operator<=>(const Event& a, const Event& b) {
    if (const auto order = a.t <=> b.t; order != 0) return order;
    if (const auto order = a.y <=> b.y; order != 0) return order;
    if (const auto order = a.x <=> b.x; order != 0) return order;
    return a.polarity <=> b.polarity;
  }
  friend constexpr bool operator==(const Event&, const Event&) = default;
};

/// Consecutive events in canonical order.
using EventSpan = std::span<const Event>;

}  // namespace esim::inline events

#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "esim/events/event.h"

namespace esim::inline events {

/// Packs events of a limited time span into integers in the canonical order of events: half the memory, faster to sort.
class EventPacking {
 public:
  EventPacking(int width, int height)
      : x_bits_(std::bit_width(static_cast<unsigned>(width - 1))),
        time_shift_(1 + x_bits_ + std::bit_width(static_cast<unsigned>(height - 1))) {}

  /// Time origin of packed events; no event may be earlier. Unpack them with the same origin.
  TimeNs origin = 0;

  /// Events must be earlier than origin + longest(): 17 s for the largest images, hours for common ones.
  TimeNs longest() const { return TimeNs{1} << (63 - time_shift_); }

  /// The bits of the integer for the pixel; the lowest bit is left for the polarity.
  std::uint64_t place(int x, int y) const {
    return (static_cast<std::uint64_t>(y) << (x_bits_ + 1)) | (static_cast<std::uint64_t>(x) << 1);
  }
  std::uint64_t pack(TimeNs since_origin, std::uint64_t place, bool on) const {
    return (static_cast<std::uint64_t>(since_origin) << time_shift_) | place | static_cast<std::uint64_t>(on);
  }
  void unpack(std::uint64_t packed, Event& out) const {
    const std::uint64_t where = packed >> 1;
    const std::uint64_t x = where & ((std::uint64_t{1} << x_bits_) - 1);
    const std::uint64_t y = (where >> x_bits_) & ((std::uint64_t{1} << (time_shift_ - 1 - x_bits_)) - 1);
    const auto t = static_cast<std::uint64_t>(origin) + (packed >> time_shift_);
    const std::int64_t polarity = static_cast<std::int64_t>(packed & 1) * 2 - 1;
    if constexpr (std::endian::native == std::endian::little && sizeof(Event) == 16) {
      // As two words: several times as fast as member by member or through a copied event.
      const std::array<std::uint64_t, 2> words{t, x | y << 16 | (static_cast<std::uint64_t>(polarity) & 0xff) << 32};
      std::memcpy(static_cast<void*>(&out), words.data(), sizeof(Event));
      return;
    }
    out.t = static_cast<TimeNs>(t);
    out.x = static_cast<std::uint16_t>(x), out.y = static_cast<std::uint16_t>(y);
    out.polarity = static_cast<std::int8_t>(polarity);
  }

  /// The time since the origin.
  TimeNs time(std::uint64_t packed) const { return static_cast<TimeNs>(packed >> time_shift_); }

  int time_shift() const { return time_shift_; }

 private:
  int x_bits_, time_shift_;
};

}  // namespace esim::inline events

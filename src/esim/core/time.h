#pragma once

#include <cmath>
#include <cstdint>

namespace esim::inline core {

/// Instants and durations, in nanoseconds. All times that are stored or compared have this type; seconds as `double`
/// appear only in spline mathematics and in the user's options.
using TimeNs = std::int64_t;

inline constexpr TimeNs kNsPerUs = 1'000;
inline constexpr TimeNs kNsPerMs = 1'000'000;
inline constexpr TimeNs kNsPerSecond = 1'000'000'000;

/// From start to end, inclusive.
struct TimeSpan {
  TimeNs start = 0, end = 0;
};

constexpr double to_seconds(TimeNs t) { return static_cast<double>(t) * 1e-9; }

/// Nearest nanosecond. `seconds` must be finite and within ±292 years.
inline TimeNs to_ns(double seconds) { return static_cast<TimeNs>(std::llround(seconds * 1e9)); }

}  // namespace esim::inline core

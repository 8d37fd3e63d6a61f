#pragma once

#include <cstdint>

#include "esim/core/time.h"

namespace esim::inline filters {

/// The number of the window that contains a time, if windows of this length start at its multiples; also before 0.
constexpr std::int64_t window_index(TimeNs t, TimeNs length) { return t / length - (t % length < 0 ? 1 : 0); }

}  // namespace esim::inline filters

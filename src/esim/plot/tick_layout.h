#pragma once

#include "esim/plot/scale.h"

namespace esim::inline plot {

enum class Direction { horizontal, vertical };

/// As many ticks as have space for their labels on an axis of `extent` px. If even the smallest number has not, only
/// every second, third, ... tick has a label.
Ticks ticks_that_fit(const Scale& scale, int extent, Direction direction);

}  // namespace esim::inline plot

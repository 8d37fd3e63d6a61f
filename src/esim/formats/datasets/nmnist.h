#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Five bytes per event, as in N-MNIST and N-Caltech101 (Orchard et al., Frontiers in Neuroscience 2015): x, y, then
/// the polarity and 23 bits of the time in us, the highest first. An event in row 240 is a delay, not an event: all
/// following times increase by 8192 us.
Format nmnist_format();

}  // namespace esim::inline formats

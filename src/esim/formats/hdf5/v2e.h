#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// The layout of v2e: an HDF5 file with one dataset, `events`, uint32 [N, 4], with rows t (us), x, y (px) and p (1: ON,
/// 0: OFF), compressed with gzip. Times are from 0 to 71 minutes.
Format v2e_format();

}  // namespace esim::inline formats

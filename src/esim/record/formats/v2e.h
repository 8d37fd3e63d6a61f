#pragma once

#include "esim/record/format.h"

namespace esim {

/// What v2e writes: an HDF5 file with one dataset, `events`, uint32 [N, 4], a row being t (us), x, y (px) and p
/// (1: ON, 0: OFF), packed with gzip. Times from 0 to 71 minutes.
Format v2e_format();

}  // namespace esim

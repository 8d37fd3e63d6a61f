#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// AEDAT 2.0 of jAER: chips DAVIS and, only read, DVS128.
Format aedat2_format();

}  // namespace esim::inline formats

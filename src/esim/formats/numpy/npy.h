#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// A structured NumPy array with the fields t, x, y, p.
Format npy_format();

/// NumPy arrays t, x, y, p, width and height in a zip file.
Format npz_format();

}  // namespace esim::inline formats

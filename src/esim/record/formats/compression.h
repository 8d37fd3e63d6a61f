#pragma once

namespace esim {

/// How the numbers in an HDF5 file are packed.
enum class Compression {
  blosc,  ///< Blosc (filter 32001), bytes shuffled: fast; readers need the filter's plugin
  gzip,   ///< deflate, bytes shuffled: every HDF5 reads it, but writing is slow
  none,
};

}  // namespace esim

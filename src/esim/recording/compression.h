#pragma once

namespace esim::inline recording {

/// Compression of the numbers in an HDF5 file.
enum class Compression {
  blosc,  ///< Blosc (filter 32001) with Zstd: fast, but readers need the plugin of the filter
  gzip,   ///< deflate with byte shuffle: readable with every HDF5 library, but slow to write
  none,
};

}  // namespace esim::inline recording

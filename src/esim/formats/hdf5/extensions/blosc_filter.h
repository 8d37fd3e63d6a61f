#pragma once

#include <hdf5.h>

// Private to formats: includes hdf5.h.
namespace esim::inline formats::hdf5 {

inline constexpr H5Z_filter_t kBloscFilter = 32001;

/// Adds Blosc's filter to the HDF5 library, which then needs no plugin for it. Call it before using the filter.
void register_blosc();

}  // namespace esim::inline formats::hdf5

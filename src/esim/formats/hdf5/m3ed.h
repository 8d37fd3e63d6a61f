#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Events in M3ED's HDF5 layout (Chaney et al., CVPRW 2023), as the left event camera:
///
///   prophesee/left/t            int64 [N]   us
///   prophesee/left/x, y         uint16 [N]  px
///   prophesee/left/p            int8 [N]    1: ON, 0: OFF
///   prophesee/left/ms_map_idx   uint64 [M]  first index with t >= index in ms; times start at 0
///   prophesee/left/calib/...    camera_model, intrinsics (fx fy cx cy), distortion_model, distortion_coeffs,
///   resolution
///
/// Camera 0 is written, with its calibration if it is a pinhole with radial-tangential distortion or without
/// distortion.
Format m3ed_format();

}  // namespace esim::inline formats

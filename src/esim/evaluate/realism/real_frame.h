#pragma once

#include <filesystem>

#include "esim/core/image.h"

// Private to evaluate.
namespace esim::inline evaluate {

/// What a camera saw, from one of its frames. Values are linear intensity, 1 = white.
struct RealFrame {
  Image<float> scene;       ///< moves
  Image<float> vignetting;  ///< factor of each pixel; does not move
};

/// Reads an 8-bit PNG image of the sensor's size, or with the frame below another one in its left column.
///
/// Black lines at the border are replaced by what is beside them. Gradual changes of
/// brightness over the frame are taken for vignetting: a quadratic polynomial of the logarithm, found by iteratively
/// reweighted least squares, so that objects hardly change it. The rest is the scene, without noise: a bilateral filter
/// of 2.5 px averages values that differ by less than about three standard deviations of the noise. Scene and frame are
/// at least 2/255. Throws UserError.
RealFrame read_real_frame(const std::filesystem::path& path, int width, int height);

}  // namespace esim::inline evaluate

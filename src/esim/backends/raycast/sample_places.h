#pragma once

#include <Eigen/Core>
#include <vector>

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Positions in a pixel, from its centre: a rank-1 lattice, with no two of them in the same row or column. Throws
/// UserError unless `samples_per_pixel` is 1, 16 or 64.
std::vector<Eigen::Vector2f> sample_places(int samples_per_pixel);

}  // namespace esim::inline backends::inline raycast

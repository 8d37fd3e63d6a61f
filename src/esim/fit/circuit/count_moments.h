#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/fit/circuit/pixel_counts.h"

// Private to fit.
namespace esim::inline fit {

/// What recordings in known light are compared by: of a lamp, the ON and the OFF events of a pixel per period; of
/// constant light, the logarithm of its OFF events per second, which only noise makes. Recordings follow each other.
struct CountMoments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;  ///< of the mean, if pixels are independent
  double pixels = 0;
};

/// Which pixels count: not those that are hot in one of the recordings, nor those without any event of a lamp.
std::vector<bool> usable_pixels(const std::vector<PixelCounts>& recordings);

/// All recordings have the same size.
CountMoments count_moments(const std::vector<PixelCounts>& recordings, const std::vector<bool>& usable);

/// The means of these pixels without each of the 8 x 8 areas of the sensor, for a jackknife; empty without pixels
/// there.
std::vector<Eigen::VectorXd> means_without_areas(const std::vector<PixelCounts>& recordings,
                                                 const std::vector<bool>& usable);

}  // namespace esim::inline fit

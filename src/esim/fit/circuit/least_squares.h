#pragma once

#include <Eigen/Core>
#include <functional>

// Private to fit.
namespace esim::inline fit {

struct LeastSquares {
  Eigen::VectorXd at;  ///< the minimum
  double squares = 0;  ///< the sum there
};
using Residuals = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// Derivatives by differences over `step` on both sides.
Eigen::MatrixXd slopes_at(const Residuals& residuals, const Eigen::VectorXd& at, double step);

/// Minimises the sum of squares of residuals by Levenberg's and Marquardt's method. No step changes a coordinate by
/// more than 1.
LeastSquares least_squares(const Residuals& residuals, Eigen::VectorXd start, double step);

}  // namespace esim::inline fit

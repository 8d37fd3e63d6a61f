#include "esim/fit/circuit/least_squares.h"

#include <Eigen/Dense>

namespace esim::inline fit {
namespace {

constexpr int kMaxSteps = 8, kMaxAttempts = 8;
constexpr double kLongest = 1;
constexpr double kSmallGain = 1e-2;  // relative decrease of the sum that ends the search

}  // namespace

Eigen::MatrixXd slopes_at(const Residuals& residuals, const Eigen::VectorXd& at, double step) {
  Eigen::MatrixXd slopes;
  for (Eigen::Index k = 0; k < at.size(); ++k) {
    Eigen::VectorXd low = at, high = at;
    low[k] -= step, high[k] += step;
    const Eigen::VectorXd slope = (residuals(high) - residuals(low)) / (2 * step);
    if (k == 0) slopes.resize(slope.size(), at.size());
    slopes.col(k) = slope;
  }
  return slopes;
}

LeastSquares least_squares(const Residuals& residuals, Eigen::VectorXd start, double step) {
  LeastSquares best{std::move(start), 0};
  Eigen::VectorXd r = residuals(best.at);
  best.squares = r.squaredNorm();
  double damping = 1e-2;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Eigen::MatrixXd slopes = slopes_at(residuals, best.at, step), normal = slopes.transpose() * slopes;
    const Eigen::VectorXd gradient = slopes.transpose() * r;
    double gain = 0;
    for (int attempt = 0; attempt < kMaxAttempts && gain == 0; ++attempt) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1 + damping;
      const Eigen::VectorXd next = best.at - damped.ldlt().solve(gradient).cwiseMax(-kLongest).cwiseMin(kLongest),
                            there = residuals(next);
      const double squares = there.squaredNorm();
      if (there.allFinite() && next.allFinite() && squares < best.squares) {
        gain = (best.squares - squares) / best.squares;
        best.at = next, best.squares = squares, r = there;
        damping *= 0.3;
      } else {
        damping *= 4;
      }
    }
    if (gain < kSmallGain) break;
  }
  return best;
}

}  // namespace esim::inline fit

#include "esim/motion/fit/banded_least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "support/numeric.h"

namespace esim {
namespace {

TEST(BandedLeastSquares, FindsTheDenseSolution) {
  constexpr int kBlocks = 7, kResiduals = 30;
  using LeastSquares = BandedLeastSquares<2, 3>;
  std::mt19937 engine(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto draw = [&] { return uniform(engine); };

  LeastSquares banded(kBlocks, 3);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(2 * kResiduals, 2 * kBlocks);
  Eigen::MatrixXd residual(2 * kResiduals, 3);
  for (int k = 0; k < kResiduals; ++k) {
    const int first = k % (kBlocks - 2);
    const int count = 1 + k % 3;
    const double weight = 1.5 + draw();
    std::vector<LeastSquares::Block> blocks;
    for (int j = 0; j < count; ++j) blocks.emplace_back(LeastSquares::Block::NullaryExpr(draw));
    const LeastSquares::Value value = LeastSquares::Value::NullaryExpr(draw);
    banded.add(first, blocks, value, weight);
    for (int j = 0; j < count; ++j) jacobian.block<2, 2>(2 * k, 2 * (first + j)) = std::sqrt(weight) * blocks[j];
    residual.middleRows<2>(2 * k) = std::sqrt(weight) * value;
  }
  const Eigen::MatrixXd expected = jacobian.colPivHouseholderQr().solve(-residual);
  const LeastSquares::Solution solution = banded.solve();
  EXPECT_LT(test::largest_difference(solution, expected), 1e-12);
  const double decrease = residual.squaredNorm() - (residual + jacobian * expected).squaredNorm();
  EXPECT_NEAR(banded.predicted_decrease(solution), decrease, 1e-12);
}

TEST(BandedLeastSquares, RefusesUnknownsThatDependOnEachOther) {
  // Two unknowns of which only one sum is known, for any rounding of its coefficients.
  for (const double a : {0.1, 0.3, 0.7, 1.1}) {
    for (const double b : {0.1, 0.2, 0.6, 1.3}) {
      using LeastSquares = BandedLeastSquares<1, 1>;
      LeastSquares problem(2, 2);
      for (const double scale : {1.0, 3.0, 0.7}) {
        const std::array<LeastSquares::Block, 2> jacobians{LeastSquares::Block(scale * a),
                                                           LeastSquares::Block(scale * b)};
        problem.add(0, jacobians, LeastSquares::Value(1.0), 1.0);
      }
      EXPECT_THROW(problem.solve(), UserError) << a << ' ' << b;
    }
  }
}

}  // namespace
}  // namespace esim

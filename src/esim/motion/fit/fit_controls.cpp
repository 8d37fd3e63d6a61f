#include "esim/motion/fit/fit_controls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/motion/fit/banded_least_squares.h"

namespace esim::inline motion {

namespace {

constexpr int kMaxDifferenceOrder = 3;

/// Coefficients of the backward difference of order 1, 2 or 3, oldest value first: (−1)^(order−j) C(order, j).
std::span<const double> difference_coefficients(int order) {
  static constexpr std::array<double, 2> kFirst{-1.0, 1.0};
  static constexpr std::array<double, 3> kSecond{1.0, -2.0, 1.0};
  static constexpr std::array<double, 4> kThird{-1.0, 3.0, -3.0, 1.0};
  if (order == 1) return kFirst;
  if (order == 2) return kSecond;
  return kThird;
}

int reach(const UniformBasis& basis, const SmoothnessPenalty& penalty) {
  return std::max(basis.order(), penalty.difference_order + 1);
}

/// The rotation problem, linearised at given control rotations in x_j: R_j ← R_j Exp(x_j).
class RotationProblem {
 public:
  using LeastSquares = BandedLeastSquares<3, 1>;

  RotationProblem(std::span<const double> times_s, std::span<const Eigen::Quaterniond> rotations,
                  const SmoothnessPenalty& penalty)
      : times_s_(times_s), rotations_(rotations), penalty_(penalty) {}

  LeastSquares linearise(const So3Spline& spline) const {
    const UniformBasis& basis = spline.basis();
    LeastSquares problem(basis.control_points(), reach(basis, penalty_));

    // Log((R(t) Exp(δ))⁻¹ R_i) = e − Jl⁻¹(e) δ + O(δ²) with e = Log(R(t)⁻¹ R_i).
    for (std::size_t i = 0; i < times_s_.size(); ++i) {
      RotationSensitivity here = spline.sensitivity(times_s_[i]);
      const Eigen::Vector3d residual = so3_log(here.rotation.conjugate() * rotations_[i]);
      const Eigen::Matrix3d chain = -so3_left_jacobian_inverse(residual);
      for (int j = 0; j < basis.order(); ++j) here.jacobian[j] = chain * here.jacobian[j];
      problem.add(here.first, std::span(here.jacobian).first(basis.order()), residual, 1.0);
    }

    // d_j = Log(R_j⁻¹ R_{j+1}) changes by Jr⁻¹(d_j) x_{j+1} − Jl⁻¹(d_j) x_j.
    const auto coefficients = difference_coefficients(penalty_.difference_order - 1);
    for (int j = 0; j < differences(spline); ++j) {
      std::array<Eigen::Matrix3d, kMaxDifferenceOrder + 1> jacobian;
      jacobian.fill(Eigen::Matrix3d::Zero());
      for (std::size_t k = 0; k < coefficients.size(); ++k) {
        const Eigen::Vector3d& increment = spline.increments()[j + k];
        jacobian[k] -= coefficients[k] * so3_left_jacobian_inverse(increment);
        jacobian[k + 1] += coefficients[k] * so3_right_jacobian_inverse(increment);
      }
      problem.add(j, std::span(jacobian).first(coefficients.size() + 1), difference(spline, j), penalty_.weight);
    }
    return problem;
  }

 private:
  int differences(const So3Spline& spline) const {
    return std::max(0, spline.basis().control_points() - penalty_.difference_order);
  }

  Eigen::Vector3d difference(const So3Spline& spline, int j) const {
    const auto coefficients = difference_coefficients(penalty_.difference_order - 1);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < coefficients.size(); ++k) sum += coefficients[k] * spline.increments()[j + k];
    return sum;
  }

  std::span<const double> times_s_;
  std::span<const Eigen::Quaterniond> rotations_;
  SmoothnessPenalty penalty_;
};

using PositionProblem = BandedLeastSquares<1, 3>;

/// The position problem for changes of the control points `controls`; all positions relative to `origin`.
PositionProblem linearise_positions(const UniformBasis& basis, std::span<const double> times_s,
                                    std::span<const Eigen::Vector3d> positions, const Eigen::Vector3d& origin,
                                    const SmoothnessPenalty& penalty, const PositionProblem::Solution& controls) {
  PositionProblem problem(basis.control_points(), reach(basis, penalty));
  const auto add = [&](int first, std::span<const double> factors, PositionProblem::Value residual, double weight) {
    std::array<PositionProblem::Block, kMaxSplineOrder> jacobian;
    for (std::size_t j = 0; j < factors.size(); ++j) {
      jacobian[j](0) = factors[j];
      residual += factors[j] * controls.row(first + static_cast<Eigen::Index>(j));
    }
    problem.add(first, std::span(jacobian).first(factors.size()), residual, weight);
  };
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const BasisWeights weights = basis.weights(times_s[i]);
    add(weights.first, std::span(weights.value).first(static_cast<std::size_t>(basis.order())),
        (origin - positions[i]).transpose(), 1.0);
  }
  for (int j = 0; j + penalty.difference_order < basis.control_points(); ++j)
    add(j, difference_coefficients(penalty.difference_order), PositionProblem::Value::Zero(), penalty.weight);
  return problem;
}

So3Spline moved(const So3Spline& spline, const Eigen::VectorXd& step) {
  std::vector<Eigen::Quaterniond> rotations = spline.rotations();
  for (std::size_t j = 0; j < rotations.size(); ++j) {
    rotations[j] = rotations[j] * so3_exp(step.segment<3>(static_cast<Eigen::Index>(3 * j)));
  }
  return So3Spline(spline.basis(), std::move(rotations));
}

}  // namespace

std::vector<Eigen::Vector3d> fit_control_positions(const UniformBasis& basis, std::span<const double> times_s,
                                                   std::span<const Eigen::Vector3d> positions,
                                                   const SmoothnessPenalty& penalty) {
  // The first step solves the linear problem. The others remove its rounding errors, which some motions of the control
  // points amplify by 1e8, since the poses hardly constrain them.
  constexpr int kSteps = 3;

  // Relative to the first position, to keep precision for coordinates far from the origin.
  const Eigen::Vector3d origin = positions.front();
  PositionProblem::Solution solution = PositionProblem::Solution::Zero(basis.control_points(), 3);
  for (int step = 0; step < kSteps; ++step)
    solution += linearise_positions(basis, times_s, positions, origin, penalty, solution).solve();
  std::vector<Eigen::Vector3d> controls;
  for (Eigen::Index j = 0; j < solution.rows(); ++j) controls.push_back(origin + solution.row(j).transpose());
  return controls;
}

std::vector<Eigen::Quaterniond> fit_control_rotations(const UniformBasis& basis, std::span<const double> times_s,
                                                      std::span<const Eigen::Quaterniond> rotations,
                                                      const SmoothnessPenalty& penalty,
                                                      std::vector<Eigen::Quaterniond> initial) {
  constexpr int kMaxSteps = 100;
  constexpr double kTolerance_rad = 1e-13;  // RMS change of the residuals by a step; rounding causes about 1e-15

  const RotationProblem problem(times_s, rotations, penalty);
  So3Spline spline(basis, std::move(initial));
  for (int i = 0; i < kMaxSteps; ++i) {
    const RotationProblem::LeastSquares linear = problem.linearise(spline);
    const Eigen::VectorXd step = linear.solve();
    spline = moved(spline, step);
    const double squared_change = linear.predicted_decrease(step);
    if (squared_change <= kTolerance_rad * kTolerance_rad * static_cast<double>(rotations.size())) {
      return spline.rotations();
    }
  }
  throw UserError(
      "trajectory fit: no smooth curve fits the rotations; check the poses for jumps and noise, or choose a shorter "
      "knot interval or a longer smoothing time");
}

}  // namespace esim::inline motion

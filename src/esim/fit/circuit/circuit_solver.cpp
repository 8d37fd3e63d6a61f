#include "esim/fit/circuit/circuit_solver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "esim/fit/circuit/circuit_simulation.h"
#include "esim/fit/circuit/least_squares.h"

namespace esim::inline fit {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

// Errors of the approximate numbers: events per period, relative; logarithm of the rate of noise.
constexpr double kRoughError = 0.1, kRoughErrorNoise = 0.3, kRoughStep = 1e-3;
constexpr double kModelError = 1e-3;  // relative error of the simulated pixel
constexpr std::array kGrid{-3.0, -2.25, -1.5, -0.75, 0.0, 0.75, 1.5, 2.25, 3.0};
constexpr double kSame = 0.3;  // of the logarithms: approximate minima that are one
constexpr std::size_t kMaxCandidates = 3;
constexpr CircuitModel::Effort kEffort{14, 16, 32}, kLastEffort{32, 24, kPointsOfPeriod};
constexpr int kApproaches = 4, kUsualRounds = 5, kMaxRounds = 16, kEvaluations = 2;
constexpr double kSmallStep = 0.07;  // of a logarithm, with which the approach ends
constexpr double kLongestStep = 0.4;
// The slopes under lamps are means over the values that are probable, but over at least a fraction, and at most all of
// these changes of the logarithms. In constant light, the slopes vary little: means over all of them.
constexpr std::array<double, CircuitModel::kParameters> kRangeOfLamps{0.08, 0.08, 0.2, 0.2, 0.25, 0.25},
    kRangeOfNoise{0.1, 0.1, 0.3, 0.3, 0.3, 0.4};
constexpr double kNarrowest = 0.5;
// The mean fourth power of a normal distribution, since the differences from the tangent are squares of the distance.
constexpr double kFourthMoment = 3;
// Standard deviations of the points by which slopes are found: within which they hold, and the longest step.
constexpr double kNear = 2, kFar = 4;
// The search ends without a solution if the sum of squares is that large, per number, and has not decreased so much in
// some rounds.
constexpr double kHopeless = 100, kGain = 0.7;
constexpr int kPatience = 3;
// Sums of squares by which a second solution may be worse: three standard deviations; before the slopes are known well.
constexpr double kTolerance = 9, kRoughTolerance = 100;

/// A symmetric matrix without negative eigenvalues.
MatrixXd positive_part(const MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (matrix + matrix.transpose()));
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).asDiagonal() * solver.eigenvectors().transpose();
}

/// The length of `step` in standard deviations of `covariance`.
double deviations(const MatrixXd& covariance, const VectorXd& step) {
  return std::sqrt(step.dot(covariance.ldlt().solve(step)));
}

/// The largest ratio of variances of a direction.
double largest_ratio(const MatrixXd& covariance, const MatrixXd& other) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(covariance, other, Eigen::EigenvaluesOnly)
      .eigenvalues()
      .maxCoeff();
}

VectorXd cut(const VectorXd& step) { return step.cwiseMax(-kLongestStep).cwiseMin(kLongestStep); }

}  // namespace

/// How the numbers of events depend on the parameters around a point, by simulations with the same random numbers.
struct CircuitSolver::Slopes {
  CountMoments middle;  // at the point
  MatrixXd slopes;      // numbers x parameters
  MatrixXd bends;  // numbers x axes of the points: differences from the tangent at one standard deviation of the points
};

/// The numbers of events as linear functions of the parameters near a point.
struct CircuitSolver::Tangent {
  VectorXd at;
  MatrixXd spread;              // covariance of the points by which the slopes are found
  MatrixXd slopes, weights;     // weights: inverse covariance of the numbers
  VectorXd other_variance;      // of the numbers, besides those of recordings and simulations
  MatrixXd precision, inverse;  // of the parameters
};

CircuitSolver::CircuitSolver(const CircuitModel& model, CircuitTarget target, std::uint64_t seed,
                             std::function<void(double)> progress)
    : model_(model), target_(std::move(target)), seed_(seed), progress_(std::move(progress)) {
  const double pixels = kEffort.lamp_side * kEffort.lamp_side, last = kLastEffort.lamp_side * kLastEffort.lamp_side,
               points = 1 + 2 * static_cast<double>(target_.start.size());
  all_ = (kApproaches + kUsualRounds * points) * pixels + kEvaluations * last;
}

std::vector<CircuitSolution> CircuitSolver::solve() {
  std::vector<Candidate> candidates;
  for (const VectorXd& start : starts()) candidates.push_back(approach(start));
  double least = candidates.front().squares;
  for (const Candidate& c : candidates) least = std::min(least, c.squares);
  std::vector<CircuitSolution> all;
  for (const Candidate& candidate : candidates) {
    if (candidate.squares <= 2 * least + kRoughTolerance) all.push_back(refine(candidate));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const CircuitSolution& a, const CircuitSolution& b) { return a.squares < b.squares; });
  const double limit = all.front().squares + kTolerance * std::max(1.0, all.front().excess());
  std::erase_if(all, [limit](const CircuitSolution& other) { return other.squares > limit; });
  // Searches that did not end tell nothing beside one that did.
  if (std::any_of(all.begin(), all.end(), [](const CircuitSolution& s) { return s.found; }))
    std::erase_if(all, [](const CircuitSolution& s) { return !s.found; });
  std::vector<CircuitSolution> solutions;
  for (const CircuitSolution& found : all) {
    const bool known = std::any_of(solutions.begin(), solutions.end(), [&](const CircuitSolution& other) {
      const VectorXd difference = found.at - other.at;
      return deviations(found.covariance + other.covariance, difference) <
             std::sqrt(kTolerance * static_cast<double>(difference.size()));
    });
    if (!known) solutions.push_back(found);
  }
  return solutions;
}

/// Distinct minima of the approximate model, the best first.
std::vector<VectorXd> CircuitSolver::starts() const {
  const VectorXd& recorded = target_.recorded.mean;
  VectorXd errors(recorded.size());
  for (Index k = 0; k < errors.size(); ++k)
    errors[k] = model_.of_lamp(k) ? kRoughError * (recorded[k] + 0.3) : kRoughErrorNoise;
  const Residuals residuals = [&](const VectorXd& p) {
    VectorXd r(errors.size() + p.size());
    r << (model_.approximate(p) - recorded).cwiseQuotient(errors),
        target_.precision.cwiseSqrt().cwiseProduct(p - target_.start);
    return r;
  };
  std::vector<LeastSquares> minima;
  const auto add = [&](const VectorXd& from) { minima.push_back(least_squares(residuals, from, kRoughStep)); };
  if (target_.grid) {
    for (const double photocurrent : kGrid) {
      for (const double follower : kGrid) {
        VectorXd from = target_.start;
        from[model_.place(CircuitModel::kPhotocurrent)] += photocurrent;
        from[model_.place(CircuitModel::kFollower)] += follower;
        add(from);
      }
    }
  } else {
    add(target_.start);
  }
  std::stable_sort(minima.begin(), minima.end(),
                   [](const LeastSquares& a, const LeastSquares& b) { return a.squares < b.squares; });
  std::vector<VectorXd> distinct;
  for (const LeastSquares& minimum : minima) {
    if (distinct.size() == kMaxCandidates || minimum.squares > minima.front().squares + kTolerance) break;
    if (std::none_of(distinct.begin(), distinct.end(),
                     [&](const VectorXd& other) { return (minimum.at - other).cwiseAbs().maxCoeff() < kSame; }))
      distinct.push_back(minimum.at);
  }
  return distinct;
}

/// By steps of Gauss and Newton, with the slopes of the approximate model.
CircuitSolver::Candidate CircuitSolver::approach(VectorXd at) {
  Candidate best;
  for (int i = 0; i < kApproaches; ++i) {
    const CountMoments here = simulate(at, kEffort);
    MatrixXd covariance = target_.recorded.covariance + here.covariance;
    covariance.diagonal() += model_variance();
    const MatrixXd slopes = approximate_slopes(at), weights = covariance.inverse();
    MatrixXd normal = slopes.transpose() * weights * slopes;
    normal.diagonal() += target_.precision;
    const VectorXd rest = target_.recorded.mean - here.mean;
    const double squares = rest.dot(weights * rest);
    if (i == 0 || squares < best.squares) best = {at, limited(normal), squares};
    const VectorXd step = cut(
        normal.ldlt().solve(slopes.transpose() * weights * rest + target_.precision.cwiseProduct(target_.start - at)));
    if (step.cwiseAbs().maxCoeff() < kSmallStep) break;
    at += step;
  }
  return best;
}

/// By simulations of many pixels. Slopes are those of two rounds near each other.
CircuitSolution CircuitSolver::refine(const Candidate& from) {
  Tangent tangent;
  tangent.at = from.at, tangent.spread = from.spread;
  std::optional<Slopes> before;
  CircuitSolution solution;
  double least = std::numeric_limits<double>::infinity();
  int last_gain = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Slopes now = find_slopes(tangent.at, tangent.spread);
    const CountMoments& here = now.middle;
    set_tangent(tangent, before ? *before : now, now, here.covariance / kEvaluations);
    const VectorXd step = step_from(tangent, tangent.at, here.mean);
    const MatrixXd spread = limited(tangent.precision);
    const double moved = deviations(tangent.spread, step), wider = largest_ratio(spread, tangent.spread);
    solution.found = before && moved < kNear && wider < kNear * kNear;
    if (solution.found) break;
    const VectorXd rest = target_.recorded.mean - here.mean;
    const double squares = rest.dot(tangent.weights * rest);
    if (squares <= kGain * least) least = squares, last_gain = round;
    if (squares > kHopeless * static_cast<double>(rest.size()) && round - last_gain == kPatience) break;
    tangent.at += step * std::min(1.0, kFar / moved);
    tangent.spread = spread;
    // Slopes that were found elsewhere do not tell the second estimate.
    before = now;
    if (moved > kNear) before.reset();
  }
  // The mean of steps from several simulations.
  const auto n = static_cast<double>(kEvaluations);
  const VectorXd& recorded = target_.recorded.mean;
  VectorXd sum = VectorXd::Zero(tangent.at.size()), rest = VectorXd::Zero(recorded.size()), next = tangent.at;
  MatrixXd simulated = MatrixXd::Zero(recorded.size(), recorded.size());
  for (int i = 0; i < kEvaluations; ++i) {
    const CountMoments here = simulate(next, kLastEffort);
    const VectorXd step = step_from(tangent, next, here.mean);
    sum += (next + step) / n, rest += (recorded - here.mean - tangent.slopes * step) / n;
    simulated += here.covariance / (n * n);
    next = sum * (n / (i + 1));
  }
  solution.at = sum;
  solution.squares = rest.dot(tangent.weights * rest);
  solution.degrees = std::max(0.0, static_cast<double>(rest.size() - sum.size()));
  simulated.diagonal() += tangent.other_variance;
  const MatrixXd gain = tangent.inverse * tangent.slopes.transpose() * tangent.weights;
  // Combinations of parameters that the numbers do not tell stay where they were before the fit.
  const VectorXd unknown = target_.precision - target_.known_precision;
  const MatrixXd untold = tangent.inverse * unknown.asDiagonal(),
                 told = MatrixXd::Identity(sum.size(), sum.size()) - untold;
  solution.covariance = told * gain * (recorded_covariance() + simulated) * gain.transpose() * told.transpose() +
                        tangent.inverse * target_.known_precision.asDiagonal() * tangent.inverse +
                        untold * unknown.cwiseInverse().asDiagonal() * untold.transpose();
  return solution;
}

/// From two estimates of the slopes.
void CircuitSolver::set_tangent(Tangent& t, const Slopes& a, const Slopes& b, const MatrixXd& simulated) const {
  t.slopes = 0.5 * (a.slopes + b.slopes);
  // The product of both has no contribution of random errors.
  MatrixXd bends = a.bends.cwiseProduct(b.bends).cwiseMax(0);
  for (Index k = 0; k < bends.rows(); ++k) {
    if (!model_.of_lamp(k)) bends.row(k).setZero();
  }
  const VectorXd beside = model_variance();
  MatrixXd covariance = target_.recorded.covariance + simulated;
  covariance.diagonal() += beside + kFourthMoment * bends.rowwise().sum();
  t.weights = covariance.inverse();
  // The random errors of one estimate would add to its square, as if the numbers told more.
  t.precision = positive_part(a.slopes.transpose() * t.weights * b.slopes);
  t.precision.diagonal() += target_.precision;
  t.inverse = t.precision.inverse();
  // Along their axes, the points have the variance 1. Where parameters are known better, the tangent holds better.
  const MatrixXd from_axes = t.spread.llt().matrixL(), to_axes = from_axes.inverse();
  const VectorXd variances = (to_axes * t.inverse * to_axes.transpose()).diagonal().cwiseMin(1);
  t.other_variance = beside + kFourthMoment * bends * variances.cwiseAbs2();
}

/// The step of Gauss and Newton from `at`, where numbers `simulated` were found.
VectorXd CircuitSolver::step_from(const Tangent& t, const VectorXd& at, const VectorXd& simulated) const {
  const VectorXd gradient = t.slopes.transpose() * t.weights * (target_.recorded.mean - simulated) +
                            target_.precision.cwiseProduct(target_.start - at);
  return cut(t.inverse * gradient);
}

/// Of the recorded means, by a jackknife over areas.
MatrixXd CircuitSolver::recorded_covariance() const {
  const auto m = static_cast<double>(target_.without_areas.size());
  VectorXd mean = VectorXd::Zero(target_.recorded.mean.size());
  for (const VectorXd& without : target_.without_areas) mean += without / m;
  MatrixXd covariance = MatrixXd::Zero(mean.size(), mean.size());
  for (const VectorXd& without : target_.without_areas)
    covariance += (m - 1) / m * (without - mean) * (without - mean).transpose();
  return covariance;
}

CountMoments CircuitSolver::simulate(const VectorXd& at, const CircuitModel::Effort& effort) {
  CountMoments found = model_.simulate({at}, {next_seed()}, effort).front();
  work(effort.lamp_side * effort.lamp_side);
  return found;
}

/// From simulations on both sides along the axes of `spread`, at sqrt(n) standard deviations for n parameters:
/// together, these points have the covariance `spread`.
CircuitSolver::Slopes CircuitSolver::find_slopes(const VectorXd& at, const MatrixXd& spread) {
  const Index n = at.size();
  const MatrixXd axes = spread.llt().matrixL();
  const double reach = std::sqrt(static_cast<double>(n));
  std::vector<VectorXd> points{at};
  for (Index k = 0; k < n; ++k) {
    for (const double side : {-reach, reach}) points.push_back(at + side * axes.col(k));
  }
  const auto found = model_.simulate(points, std::vector<std::uint64_t>(points.size(), next_seed()), kEffort);
  work(static_cast<double>(points.size()) * kEffort.lamp_side * kEffort.lamp_side);
  MatrixXd values(found.front().mean.size(), 2 * n + 1), along(values.rows(), n);
  for (Index k = 0; k <= 2 * n; ++k) values.col(k) = found[static_cast<std::size_t>(k)].mean;
  for (Index k = 0; k < n; ++k) along.col(k) = (values.col(2 * k + 2) - values.col(2 * k + 1)) / (2 * reach);
  Slopes result{found.front(), {}, {}};
  // along = slopes axes
  result.slopes = axes.transpose().triangularView<Eigen::Upper>().solve(along.transpose()).transpose();
  result.bends.resize(values.rows(), n);
  for (Index k = 0; k < n; ++k)
    result.bends.col(k) = (0.5 * (values.col(2 * k + 2) + values.col(2 * k + 1)) - values.col(0)) / (reach * reach);
  return result;
}

MatrixXd CircuitSolver::approximate_slopes(const VectorXd& at) const {
  return slopes_at([this](const VectorXd& p) { return model_.approximate(p); }, at, kRoughStep);
}

/// Of the numbers, by errors of the simulated pixel.
VectorXd CircuitSolver::model_variance() const {
  const VectorXd& recorded = target_.recorded.mean;
  VectorXd variance(recorded.size());
  for (Index k = 0; k < variance.size(); ++k)
    variance[k] = std::pow(kModelError * (model_.of_lamp(k) ? recorded[k] + 0.05 : 1.0), 2);
  return variance;
}

/// The covariance to which a precision belongs, within the limits of the points of find_slopes().
MatrixXd CircuitSolver::limited(const MatrixXd& precision) const {
  const Index n = precision.rows();
  VectorXd widest(n);
  for (Index k = 0; k < n; ++k)
    widest[k] =
        (model_.has_lamps() ? kRangeOfLamps : kRangeOfNoise)[model_.parameter(k)] / std::sqrt(static_cast<double>(n));
  const auto only_noise = [&](Index k) { return !model_.has_lamps() || model_.parameter(k) >= CircuitModel::kCharge; };
  MatrixXd bounded = precision;
  bounded.diagonal() += widest.cwiseAbs2().cwiseInverse();
  MatrixXd spread = bounded.inverse();
  for (Index k = 0; k < n; ++k) {
    spread(k, k) += std::pow(kNarrowest * widest[k], 2);
    if (!only_noise(k)) continue;
    spread.row(k).setZero(), spread.col(k).setZero();
    spread(k, k) = widest[k] * widest[k];
  }
  return spread;
}

void CircuitSolver::work(double pixels) {
  done_ += pixels;
  if (progress_) progress_(std::min(1.0, done_ / all_));
}

/// Different seeds for all recordings of an evaluation, too.
std::uint64_t CircuitSolver::next_seed() {
  return seed_ += static_cast<std::uint64_t>(target_.recorded.mean.size()) + 1;
}

}  // namespace esim::inline fit

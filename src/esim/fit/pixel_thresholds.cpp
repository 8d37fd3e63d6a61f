#include "esim/fit/pixel_thresholds.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "esim/stats/numerics/median.h"

namespace esim::inline fit {
namespace {

constexpr double kTypicalSpread = 0.05;           // of thresholds from pixel to pixel, for weights
constexpr double kPoor = 0.25;                    // relative error of a threshold beyond which a pixel does not count
constexpr std::uint32_t kFewestOfPixel = 6;       // equations
constexpr std::uint64_t kFewestEquations = 1000;  // equations of all pixels
constexpr int kBlock = 8;                         // px
constexpr double kMostOfBlock = 0.9;
constexpr double kExplained = 0.5;  // fraction of the variance of L below which nothing is determined

}  // namespace

PixelThresholds::PixelThresholds(int width, int height) : width_(width), height_(height), areas_(width, height) {}

PixelThresholds::Sums::Sums(const EquationProducts& products) {
  std::size_t at = 0;
  for (int i = 0; i < kUnknowns; ++i) {
    for (int j = i; j < kUnknowns; ++j) matrix(i, j) = matrix(j, i) = products[at++];
    vector(i) = products[at++];
  }
  square = products[at];
}

std::optional<PixelThresholds::Solution> PixelThresholds::solve(const Sums& sums) {
  const Eigen::Matrix<double, kOfPixel, kOfPixel> own = sums.matrix.topLeftCorner<kOfPixel, kOfPixel>();
  if (!(own.determinant() > 1e-9 * own.diagonal().prod())) return std::nullopt;
  const Eigen::Matrix<double, kOfPixel, kOfPixel> inverse = own.inverse();
  return Solution{inverse * sums.vector.head<kOfPixel>(), inverse * sums.matrix.topRightCorner<kOfPixel, kShared>(),
                  inverse.diagonal().head<2>()};
}

std::size_t PixelThresholds::block_of(int x, int y) const {
  const int blocks = (width_ + kBlock - 1) / kBlock;
  return static_cast<std::size_t>(y / kBlock * blocks + x / kBlock);
}

void PixelThresholds::add(int x, int y, const std::array<EquationProducts, 2>& halves,
                          const std::array<std::uint32_t, 2>& equations) {
  const std::uint32_t number = equations[0] + equations[1];
  if (number < kFewestOfPixel) return;
  EquationProducts products = halves[0];
  for (std::size_t i = 0; i < products.size(); ++i) products[i] += halves[1][i];
  const Sums sums(products);
  const std::optional<Solution> solution = solve(sums);
  if (!solution) return;
  Pixel pixel{sums, *solution, {}, {}, {}, static_cast<double>(number), areas_.of(x, y), block_of(x, y)};
  for (std::size_t half = 0; half < 2; ++half) {
    if (equations[half] >= kFewestOfPixel) pixel.halves[half] = solve(Sums(halves[half]));
  }
  const auto across = sums.matrix.bottomLeftCorner<kShared, kOfPixel>();
  pixel.left = sums.matrix.bottomRightCorner<kShared, kShared>() - across * solution->by_shared;
  pixel.right = sums.vector.tail<kShared>() - across * solution->alone;
  all_.push_back(pixel);
  equations_ += number;
}

std::optional<std::string> PixelThresholds::solve() {
  if (equations_ < kFewestEquations) {
    return fmt::format("only {} events lie near images of a scene that moves; at least {} are necessary", equations_,
                       kFewestEquations);
  }
  shared_ = find_shared(std::nullopt);
  find_residual();
  if (!(explained_ > kExplained)) {
    return fmt::format(
        "the events explain only {:.0f} % of the changes of brightness in the images: they do not show "
        "the same motion",
        100 * std::max(0.0, explained_));
  }
  if (!(typical_thresholds().minCoeff() > 0))
    return "the brightness of the images falls at ON events or rises at OFF events";
  const std::vector<bool> used = choose_pixels();
  const auto values = jackknife(used, [this](std::optional<std::size_t> without) { return evaluate(without); });
  if (!values) {
    return fmt::format(
        "enough pixels have enough events near images in only {} of {} areas of the sensor; at least {} "
        "are necessary: record longer, or more texture",
        std::count(used.begin(), used.end(), true), used.size(), kFewestAreas);
  }
  values_ = *values;
  return std::nullopt;
}

/// What all pixels share, by least squares, `without` some area. What is not determined is 0.
PixelThresholds::Shared PixelThresholds::find_shared(std::optional<std::size_t> without) const {
  SharedMatrix left = SharedMatrix::Zero();
  Shared right = Shared::Zero();
  for (const Pixel& pixel : all_) {
    if (pixel.area != without) left += pixel.left, right += pixel.right;
  }
  const Eigen::SelfAdjointEigenSolver<SharedMatrix> solver(left);
  Shared along = solver.eigenvectors().transpose() * right;
  for (int i = 0; i < kShared; ++i) {
    const double value = solver.eigenvalues()(i);
    along(i) = value > 1e-12 * solver.eigenvalues().maxCoeff() ? along(i) / value : 0.0;
  }
  return solver.eigenvectors() * along;
}

void PixelThresholds::find_residual() {
  double squares = 0, degrees = 0, total = 0;
  for (const Pixel& pixel : all_) {
    Vector found;
    found << pixel.solution.at(shared_), shared_;
    squares += pixel.sums.square - 2 * found.dot(pixel.sums.vector) + found.dot(pixel.sums.matrix * found);
    total += pixel.sums.square;
    degrees += std::max(0.0, pixel.equations - kOfPixel);
  }
  variance_ = std::max(0.0, squares / degrees);
  explained_ = 1 - squares / total;
}

Eigen::Vector2d PixelThresholds::typical_thresholds() const {
  Eigen::Vector2d typical;
  for (int k = 0; k < 2; ++k) {
    std::vector<double> values;
    for (const Pixel& pixel : all_) values.push_back(pixel.solution.at(shared_)(k));
    typical(k) = median(std::move(values));
  }
  return typical;
}

/// Sets the weights of pixels; returns which areas have any.
std::vector<bool> PixelThresholds::choose_pixels() {
  const Eigen::Vector2d typical = typical_thresholds(), spread = (kTypicalSpread * typical).cwiseAbs2();
  const auto is_good = [&](const std::optional<Solution>& s) {
    return s && (variance_ * s->variance).cwiseSqrt().cwiseQuotient(typical).maxCoeff() < kPoor;
  };
  std::vector<int> of_block(block_of(width_ - 1, height_ - 1) + 1), good(of_block.size());
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) ++of_block[block_of(x, y)];
  }
  for (const Pixel& pixel : all_) good[pixel.block] += is_good(pixel.solution);
  std::vector<bool> used(areas_.areas());
  for (Pixel& pixel : all_) {
    if (!is_good(pixel.solution) || good[pixel.block] < kMostOfBlock * of_block[pixel.block]) continue;
    ++pixels_;
    used[pixel.area] = true;
    pixel.weight = (spread + variance_ * pixel.solution.variance).cwiseInverse();
    if (!is_good(pixel.halves[0]) || !is_good(pixel.halves[1])) continue;
    ++pixels_with_halves_;
    pixel.weight_of_halves = pixel.weight.prod();
  }
  return used;
}

/// The values of Value, `without` some area.
std::vector<double> PixelThresholds::evaluate(std::optional<std::size_t> without) const {
  const Shared shared = find_shared(without);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), weights = sum, first = sum, second = sum;
  Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
  double n = 0;
  for (const Pixel& pixel : all_) {
    if (pixel.area == without) continue;
    sum += pixel.weight.cwiseProduct(pixel.solution.thresholds(shared));
    weights += pixel.weight;
    const double weight = pixel.weight_of_halves;
    if (weight == 0) continue;
    const Eigen::Vector2d a = pixel.halves[0]->thresholds(shared), b = pixel.halves[1]->thresholds(shared);
    first += weight * a, second += weight * b, n += weight;
    products += weight * 0.5 * (a * b.transpose() + b * a.transpose());
  }
  const Eigen::Vector2d mean = sum.cwiseQuotient(weights);
  first /= n, second /= n;
  const Eigen::Matrix2d covariance = products / n - 0.5 * (first * second.transpose() + second * first.transpose());
  const double common = covariance(0, 1) / mean.prod();
  const double own = 0.5 * (covariance.trace() - common * mean.squaredNorm());
  return {mean(0), mean(1), own, common, shared(0), shared(2)};
}

std::vector<double> PixelThresholds::thresholds(int k) const {
  std::vector<double> values;
  for (const Pixel& pixel : all_) {
    if (pixel.weight(k) > 0) values.push_back(pixel.solution.at(shared_)(k));
  }
  return values;
}

double PixelThresholds::typical_error(int k) const {
  std::vector<double> errors;
  for (const Pixel& pixel : all_) {
    if (pixel.weight(k) > 0) errors.push_back(variance_ * pixel.solution.variance(k));
  }
  return std::sqrt(median(std::move(errors)));
}

}  // namespace esim::inline fit

#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esim/fit/equations.h"
#include "esim/fit/jackknife.h"

// Private to fit.
namespace esim::inline fit {

/// The normal equations of pixels, and the distribution of the thresholds that follows from them.
class PixelThresholds {
 public:
  PixelThresholds(int width, int height);

  /// The equations of a pixel from odd and even stretches of time, about their means, and their numbers.
  void add(int x, int y, const std::array<EquationProducts, 2>& halves, const std::array<std::uint32_t, 2>& equations);

  /// Solves everything; returns why nothing is determined, if so.
  std::optional<std::string> solve();

  /// Everything with its error. Parts of variance may come out below 0.
  enum Value : std::size_t { kOn, kOff, kOwnVariance, kCommonVariance, kDelay, kOffset };
  const std::vector<Jackknifed>& values() const { return values_; }

  std::uint64_t equations() const { return equations_; }
  std::uint64_t pixels() const { return pixels_; }  ///< that count
  double residual() const { return std::sqrt(variance_); }
  double explained() const { return explained_; }
  bool knows_spread() const { return 2 * pixels_with_halves_ >= pixels_; }

  /// The thresholds of the pixels that count, and the median of their errors, by polarity: 0, 1 for ON, OFF.
  std::vector<double> thresholds(int k) const;
  double typical_error(int k) const;

 private:
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  using Own = Eigen::Matrix<double, kOfPixel, 1>;
  using Shared = Eigen::Matrix<double, kShared, 1>;
  using SharedMatrix = Eigen::Matrix<double, kShared, kShared>;

  /// EquationProducts as matrices.
  struct Sums {
    Matrix matrix;
    Vector vector;
    double square = 0;  // of L
    explicit Sums(const EquationProducts& products);
  };
  /// The unknowns of a pixel as a linear function of those of all.
  struct Solution {
    Own alone;
    Eigen::Matrix<double, kOfPixel, kShared> by_shared;
    Eigen::Vector2d variance;  // of the thresholds, if that of an equation is 1

    Own at(const Shared& shared) const { return alone - by_shared * shared; }
    Eigen::Vector2d thresholds(const Shared& shared) const { return at(shared).head<2>(); }
  };
  struct Pixel {
    Sums sums;
    Solution solution;
    std::array<std::optional<Solution>, 2> halves;
    SharedMatrix left;  // normal equations of what all pixels share
    Shared right;
    double equations = 0;
    std::size_t area = 0, block = 0;
    Eigen::Vector2d weight = Eigen::Vector2d::Zero();  // 0: the pixel does not count
    double weight_of_halves = 0;
  };

  static std::optional<Solution> solve(const Sums& sums);
  std::size_t block_of(int x, int y) const;
  Shared find_shared(std::optional<std::size_t> without) const;
  void find_residual();
  Eigen::Vector2d typical_thresholds() const;
  std::vector<bool> choose_pixels();
  std::vector<double> evaluate(std::optional<std::size_t> without) const;

  int width_, height_;
  AreaGrid areas_;
  std::vector<Pixel> all_;
  Shared shared_ = Shared::Zero();
  double variance_ = 0, explained_ = 0;
  std::uint64_t equations_ = 0, pixels_ = 0, pixels_with_halves_ = 0;
  std::vector<Jackknifed> values_;
};

}  // namespace esim::inline fit

#include "esim/geometry/distortion.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace esim::inline geometry {

namespace {

constexpr int kMaxNewtonSteps = 100;
constexpr int kMaxHalvings = 60;

/// c[0] + c[1] s + … + c[N−1] s^(N−1).
template <std::size_t N>
double polynomial(const std::array<double, N>& c, double s) {
  double value = 0.0;
  for (std::size_t i = N; i-- > 0;) value = value * s + c[i];
  return value;
}

/// The coefficients of d/dr [r q(r²)] as a polynomial in r², from those of q.
template <std::size_t N>
std::array<double, N> slope_of_odd(std::array<double, N> c) {
  for (std::size_t i = 0; i < N; ++i) c[i] *= 2.0 * static_cast<double>(i) + 1.0;
  return c;
}

/// Whether a polynomial in Bernstein form is positive on [0, 1]: it is if all coefficients are positive, and is not if
/// one at an end is not positive; otherwise both halves are tested (de Casteljau's subdivision).
template <std::size_t N>
bool bernstein_positive(std::array<double, N> c, int depth) {
  bool all_positive = true;
  for (const double value : c) all_positive = all_positive && value > 0.0;
  if (all_positive) return true;
  if (depth == 0 || !(c.front() > 0.0) || !(c.back() > 0.0)) return false;
  std::array<double, N> left{};
  for (std::size_t i = 0; i < N; ++i) {
    left[i] = c[0];
    for (std::size_t j = 0; j + 1 < N - i; ++j) c[j] = 0.5 * (c[j] + c[j + 1]);
  }
  // The overwritten coefficients are those of the right half.
  return bernstein_positive(left, depth - 1) && bernstein_positive(c, depth - 1);
}

/// Whether the polynomial is positive on [0, end]. A minimum of zero counts as not positive.
template <std::size_t N>
bool positive_up_to(const std::array<double, N>& c, double end) {
  // Bernstein coefficient i is Σ_{j≤i} C(i,j)/C(n,j) c_j end^j, of degree n = N − 1.
  std::array<double, N> bernstein{};
  std::array<double, N> scaled{};
  double power = 1.0, choose_n = 1.0;
  for (std::size_t j = 0; j < N; ++j) {
    scaled[j] = c[j] * power / choose_n;
    power *= end;
    choose_n = choose_n * static_cast<double>(N - 1 - j) / static_cast<double>(j + 1);
  }
  for (std::size_t i = 0; i < N; ++i) {
    double choose_i = 1.0;
    for (std::size_t j = 0; j <= i; ++j) {
      bernstein[i] += choose_i * scaled[j];
      choose_i = choose_i * static_cast<double>(i - j) / static_cast<double>(j + 1);
    }
  }
  return bernstein_positive(bernstein, 40);
}

/// Moves a point along its direction from the centre to the radius `ratio` r, which has the given slope with respect to
/// r: the Jacobian is the slope in radial direction and the ratio in tangential direction.
Distorted radially(const Eigen::Vector2d& ideal, double r, double ratio, double slope) {
  if (r == 0.0) return {ideal * ratio, Eigen::Matrix2d::Identity() * ratio};
  const Eigen::Vector2d direction = ideal / r;
  const Eigen::Matrix2d across = Eigen::Matrix2d::Identity() - direction * direction.transpose();
  return {ideal * ratio, ratio * across + slope * direction * direction.transpose()};
}

std::array<double, 4> radial_polynomial(const RadialTangential& m) { return {1.0, m.k1, m.k2, m.k3}; }

/// In polar coordinates about the axis, φ from the direction (p2, p1) and q = r |(p1, p2)|, the Jacobian is
///   [slope + 6 q cos φ, −2 q sin φ; −2 q sin φ, ratio + 2 q cos φ],
/// where the slope belongs to r · ratio. It is positive definite for every φ if slope > 6.4 q at all radii up to r,
/// since then ratio > 3.2 q and the determinant has its minimum at φ = π.
bool radius_in_domain(const RadialTangential& model, double r) {
  const auto slope = slope_of_odd(radial_polynomial(model));
  const double tangential = 6.4 * std::hypot(model.p1, model.p2);
  return positive_up_to<7>({slope[0], -tangential, slope[1], 0.0, slope[2], 0.0, slope[3]}, r);
}

std::array<double, 5> angle_polynomial(const Equidistant& m) { return {1.0, m.k1, m.k2, m.k3, m.k4}; }

bool angle_in_domain(const Equidistant& model, double theta) {
  return theta >= 0.0 && theta < 0.5 * std::numbers::pi &&
         positive_up_to(slope_of_odd(angle_polynomial(model)), theta * theta);
}

bool negligible(double error, double scale) { return error <= 4.0 * std::numeric_limits<double>::epsilon() * scale; }

}  // namespace

std::optional<Distorted> distort(const NoDistortion&, const Eigen::Vector2d& ideal) {
  return Distorted{ideal, Eigen::Matrix2d::Identity()};
}

std::optional<Distorted> distort(const RadialTangential& model, const Eigen::Vector2d& ideal) {
  const double x = ideal.x(), y = ideal.y();
  const double r = ideal.norm();
  const double squared = r * r;
  if (!std::isfinite(squared) || !radius_in_domain(model, r)) return std::nullopt;

  const auto radial = radial_polynomial(model);
  Distorted result = radially(ideal, r, polynomial(radial, squared), polynomial(slope_of_odd(radial), squared));
  result.point.x() += 2.0 * model.p1 * x * y + model.p2 * (squared + 2.0 * x * x);
  result.point.y() += model.p1 * (squared + 2.0 * y * y) + 2.0 * model.p2 * x * y;
  const double mixed = 2.0 * model.p1 * x + 2.0 * model.p2 * y;
  result.jacobian(0, 0) += 2.0 * model.p1 * y + 6.0 * model.p2 * x;
  result.jacobian(0, 1) += mixed;
  result.jacobian(1, 0) += mixed;
  result.jacobian(1, 1) += 6.0 * model.p1 * y + 2.0 * model.p2 * x;
  return result;
}

std::optional<Distorted> distort(const Equidistant& model, const Eigen::Vector2d& ideal) {
  const double r = ideal.norm();
  const double theta = std::atan(r);
  if (!std::isfinite(r) || !angle_in_domain(model, theta)) return std::nullopt;
  const auto factors = angle_polynomial(model);
  const double squared = theta * theta;
  const double ratio = (r == 0.0 ? 1.0 : theta / r) * polynomial(factors, squared);
  return radially(ideal, r, ratio, polynomial(slope_of_odd(factors), squared) / (1.0 + r * r));
}

std::optional<Distorted> distort(const Fov& model, const Eigen::Vector2d& ideal) {
  const double r = ideal.norm();
  if (!std::isfinite(r)) return std::nullopt;
  const double gain = 2.0 * std::tan(0.5 * model.w);
  const double ratio = r == 0.0 ? gain / model.w : std::atan(gain * r) / (model.w * r);
  return radially(ideal, r, ratio, gain / (model.w * (1.0 + gain * r * gain * r)));
}

std::optional<Eigen::Vector2d> undistort(const NoDistortion&, const Eigen::Vector2d& distorted) { return distorted; }

// Newton's method from the centre; each step is halved until it stays in the domain and reduces the error.
std::optional<Eigen::Vector2d> undistort(const RadialTangential& model, const Eigen::Vector2d& distorted) {
  const double scale = distorted.norm();
  Eigen::Vector2d ideal = Eigen::Vector2d::Zero();
  std::optional<Distorted> here = distort(model, ideal);
  double error = scale;
  for (int i = 0; i < kMaxNewtonSteps && !negligible(error, scale); ++i) {
    Eigen::Vector2d step = here->jacobian.inverse() * (distorted - here->point);
    bool closer = false;
    for (int halvings = 0; !closer && halvings < kMaxHalvings; ++halvings, step *= 0.5) {
      const auto trial = distort(model, ideal + step);
      if (!trial || !((distorted - trial->point).norm() < error)) continue;
      closer = true;
      ideal += step;
      here = trial;
      error = (distorted - trial->point).norm();
    }
    if (!closer) break;
  }
  // Rounding may keep the error a few units in the last place above `negligible`.
  if (!(error <= 1e-13 * scale)) return std::nullopt;
  return ideal;
}

// The same for the angle; undistorted radii would be ill-conditioned towards π/2.
std::optional<Eigen::Vector2d> undistort(const Equidistant& model, const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (radius == 0.0) return distorted;
  const auto factors = angle_polynomial(model);
  const auto slope = slope_of_odd(factors);
  double theta = 0.0, error = radius;
  for (int i = 0; i < kMaxNewtonSteps && !negligible(std::abs(error), radius); ++i) {
    double step = error / polynomial(slope, theta * theta);
    bool closer = false;
    for (int halvings = 0; !closer && halvings < kMaxHalvings; ++halvings, step *= 0.5) {
      const double trial = theta + step;
      const double trial_error = radius - trial * polynomial(factors, trial * trial);
      if (!angle_in_domain(model, trial) || !(std::abs(trial_error) < std::abs(error))) continue;
      closer = true;
      theta = trial;
      error = trial_error;
    }
    if (!closer) break;
  }
  if (!(std::abs(error) <= 1e-13 * radius)) return std::nullopt;
  return distorted * (std::tan(theta) / radius);
}

std::optional<Eigen::Vector2d> undistort(const Fov& model, const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (radius == 0.0) return distorted;
  const double angle = radius * model.w;
  if (!(angle < 0.5 * std::numbers::pi)) return std::nullopt;
  return distorted * (std::tan(angle) / (2.0 * std::tan(0.5 * model.w) * radius));
}

double domain_radius(const Distortion& model) {
  constexpr double kMost = 1e3;
  const auto valid = [&](double radius) {
    return std::visit([&](const auto& lens) { return distort(lens, {radius, 0.0}).has_value(); }, model);
  };
  double inside = 0, outside = kMost;
  if (valid(kMost)) return kMost;
  for (int i = 0; i < kMaxHalvings; ++i) {
    const double middle = (inside + outside) / 2;
    (valid(middle) ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace esim::inline geometry

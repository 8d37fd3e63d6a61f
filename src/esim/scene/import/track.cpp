#include "esim/scene/import/track.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace esim::inline scene {
namespace {

/// The keys around a time: at the first key if `hold` and everything is constant, otherwise between `key` and the next.
struct Place {
  std::size_t key = 0;
  bool hold = true;
  double fraction = 0, interval_s = 1;
};

Place place_in(const std::vector<double>& times, Interpolation interpolation, double t_s) {
  const auto after = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), t_s) - times.begin());
  if (after == 0) return {};
  Place place{after - 1};
  if (after == times.size() || interpolation == Interpolation::step) return place;
  place.hold = false;
  place.interval_s = times[after] - times[after - 1];
  place.fraction = (t_s - times[after - 1]) / place.interval_s;
  return place;
}

/// Factors of the value, the slope after it, the slope before the next value, and the next value.
using Factors = std::array<double, 4>;

/// The Hermite spline (glTF 2.0, appendix C.5) and its derivative.
void hermite(const Place& at, Factors& value, Factors& slope) {
  const double s = at.fraction, s2 = s * s, s3 = s2 * s, d = at.interval_s;
  value = {2 * s3 - 3 * s2 + 1, d * (s3 - 2 * s2 + s), d * (s3 - s2), 3 * s2 - 2 * s3};
  slope = {(6 * s2 - 6 * s) / d, 3 * s2 - 4 * s + 1, 3 * s2 - 2 * s, (6 * s - 6 * s2) / d};
}

Eigen::Vector4d normalised(const Eigen::Vector4d& rotation) {
  const double norm = rotation.norm();
  return norm > 1e-9 ? Eigen::Vector4d(rotation / norm) : Eigen::Vector4d::UnitW();
}

/// Normalises a rotation and its slope.
TrackSample normalised(const TrackSample& sample) {
  const double norm = sample.value.norm();
  if (!(norm > 1e-9)) return {Eigen::Vector4d::UnitW(), Eigen::Vector4d::Zero()};
  const Eigen::Vector4d q = sample.value / norm;
  return {q, (sample.slope - q * q.dot(sample.slope)) / norm};
}

/// Turns from one rotation to another at a constant rate, along the shorter path.
TrackSample turned(const Eigen::Vector4d& from, const Eigen::Vector4d& to, const Place& at) {
  constexpr double kSmall_rad = 1e-6;  // below, the sine equals its angle in double precision
  const Eigen::Vector4d a = normalised(from);
  Eigen::Vector4d b = normalised(to);
  if (a.dot(b) < 0) b = -b;
  const double angle = 2 * std::atan2((b - a).norm(), (b + a).norm());
  if (angle < kSmall_rad) return normalised(TrackSample{a + at.fraction * (b - a), (b - a) / at.interval_s});
  const double s = at.fraction, sine = std::sin(angle), rate = angle / at.interval_s;
  return {(std::sin((1 - s) * angle) * a + std::sin(s * angle) * b) / sine,
          rate * (std::cos(s * angle) * b - std::cos((1 - s) * angle) * a) / sine};
}

}  // namespace

TrackSample sample_at(const Track& track, double t_s, bool is_rotation) {
  const bool cubic = track.interpolation == Interpolation::cubic;
  const auto key = [&](std::size_t i) -> const Eigen::Vector4d& { return track.values[cubic ? 3 * i + 1 : i]; };
  const Place at = place_in(track.times_s, track.interpolation, t_s);
  TrackSample sample;
  if (at.hold) {
    sample.value = key(at.key);
  } else if (cubic) {
    Factors value, slope;
    hermite(at, value, slope);
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector4d& term = track.values[3 * at.key + 1 + i];
      sample.value += value[i] * term, sample.slope += slope[i] * term;
    }
  } else if (is_rotation) {
    return turned(key(at.key), key(at.key + 1), at);
  } else {
    const Eigen::Vector4d change = key(at.key + 1) - key(at.key);
    sample = {key(at.key) + at.fraction * change, change / at.interval_s};
  }
  return is_rotation ? normalised(sample) : sample;
}

void sample_at(const WeightTrack& track, double t_s, std::size_t count, std::vector<float>& weights,
               std::vector<float>& slopes) {
  const bool cubic = track.interpolation == Interpolation::cubic;
  const Place at = place_in(track.times_s, track.interpolation, t_s);
  weights.assign(count, 0), slopes.assign(count, 0);
  const auto add = [&](std::size_t row, double value, double slope) {
    const float* const from = &track.values[row * count];
    for (std::size_t i = 0; i < count; ++i) {
      weights[i] += static_cast<float>(value) * from[i];
      slopes[i] += static_cast<float>(slope) * from[i];
    }
  };
  const std::size_t row = cubic ? 3 * at.key + 1 : at.key;
  if (count == 0) return;
  if (at.hold) return add(row, 1, 0);
  if (cubic) {
    Factors value, slope;
    hermite(at, value, slope);
    for (std::size_t i = 0; i < 4; ++i) add(row + i, value[i], slope[i]);
  } else {
    add(row, 1 - at.fraction, -1 / at.interval_s);
    add(row + 1, at.fraction, 1 / at.interval_s);
  }
}

bool varies(const Track& track) {
  constexpr double kNegligible = 1e-7;  // relative to the values, which have single precision
  const bool cubic = track.interpolation == Interpolation::cubic;
  for (std::size_t i = 0; i < track.values.size(); ++i) {
    const bool is_slope = cubic && i % 3 != 1;
    const Eigen::Vector4d still = is_slope ? Eigen::Vector4d::Zero() : track.values[cubic ? 1 : 0];
    if ((track.values[i] - still).norm() > kNegligible * std::max(1.0, still.norm())) return true;
  }
  return false;
}

bool varies(const WeightTrack& track, std::size_t count) {
  constexpr float kNegligible = 1e-7F;
  const bool cubic = track.interpolation == Interpolation::cubic;
  for (std::size_t i = 0; count > 0 && i < track.values.size(); ++i) {
    const bool is_slope = cubic && i / count % 3 != 1;
    const float still = is_slope ? 0.0F : track.values[(cubic ? count : 0) + i % count];
    if (std::abs(track.values[i] - still) > kNegligible) return true;
  }
  return false;
}

}  // namespace esim::inline scene

#include "esim/dataset/generators/affine_motion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "esim/core/random.h"

namespace esim::inline dataset {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

/// Changes at strength 1, and the fraction of each that is reached half-way.
struct Direction {
  Eigen::Vector2d translation = Eigen::Vector2d::Zero();  // px
  double rotation = 0;                                    // rad
  Eigen::Vector2d log_scale = Eigen::Vector2d::Zero();    // along the image's rows and columns
  double shear = 0;
  std::array<double, 6> half_way{};
};

/// Root mean square distance of the sensor's pixels from its centre.
double spread_px(PixelSize sensor) {
  const double w = sensor.width, h = sensor.height;
  return std::sqrt((w * w + h * h) / 12);
}

Direction draw_direction(const MotionMix& mix, PixelSize sensor, std::uint64_t seed, std::uint32_t number) {
  constexpr double kMaxUnevenness = 0.1;  // the speed at the start is 1 + 3 times this
  const AddressedRandom random(seed, Purpose::dataset_motion);
  const auto [x, y] = random.normals(number, 0);
  const auto [turn, growth] = random.normals(number, 1);
  const auto [stretch, shear] = random.normals(number, 2);
  const double spread = spread_px(sensor);
  Direction direction;
  direction.translation = mix.translation / std::numbers::sqrt2 * Eigen::Vector2d(x, y);
  direction.rotation = mix.rotation * turn / spread;
  const double both = mix.scale * growth / spread, apart = mix.shear / std::numbers::sqrt2 * stretch / spread;
  direction.log_scale = {both + apart, both - apart};
  direction.shear = mix.shear * shear / spread;
  for (std::size_t i = 0; i < direction.half_way.size(); ++i) {
    const double u = random.uniforms(number, 3 + i / 2)[i % 2];
    direction.half_way[i] = 0.5 + kMaxUnevenness * (2 * u - 1);
  }
  return direction;
}

/// The placement of a sprite after a motion of `strength`, or after a fraction of it for each kind of motion.
SpritePose go(const AffineStart& start, const Direction& direction, double strength,
              const std::array<double, 6>& fraction = {1, 1, 1, 1, 1, 1}) {
  SpritePose key;
  key.position = strength * direction.translation.cwiseProduct(Eigen::Vector2d(fraction[0], fraction[1]));
  key.rotation_deg = start.rotation_deg + kDegreesPerRadian * strength * fraction[2] * direction.rotation;
  for (const Eigen::Index i : {0, 1}) {
    key.scale[i] =
        start.scale * std::exp(strength * fraction[3 + static_cast<std::size_t>(i)] * direction.log_scale[i]);
  }
  key.shear = strength * fraction[5] * direction.shear;
  return key;
}

SpritePlacement placement(const SpritePose& key, PixelSize sensor) {
  const SpriteMotion motion({key}, SpriteInterpolation::linear);
  return place(motion.at(0), SpriteUnits::pixel, {1, 1}, sensor);
}

/// Exactly, over the grid of pixels.
double rms_px(const AffineFlow& optical_flow, PixelSize sensor) {
  const Eigen::Vector2d variance((sensor.width * 1.0 * sensor.width - 1) / 12,
                                 (sensor.height * 1.0 * sensor.height - 1) / 12);
  return std::sqrt(optical_flow.at_middle.squaredNorm() + (optical_flow.gradient.cwiseAbs2() * variance).sum());
}

/// The strength that gives the root mean square optical flow.
double strength_for(double wanted_px, const AffineStart& start, const Direction& direction, PixelSize sensor) {
  const SpritePlacement first = placement(go(start, direction, 0), sensor);
  const auto reached = [&](double strength) {
    return rms_px(flow_between(first, placement(go(start, direction, strength), sensor), sensor), sensor);
  };
  double low = 0, high = wanted_px > 0 ? 1 : 0;
  for (int doublings = 0; reached(high) < wanted_px && doublings < 64; ++doublings) low = high, high *= 2;
  for (int halvings = 0; halvings < 40; ++halvings) {
    const double middle = 0.5 * (low + high);
    (reached(middle) < wanted_px ? low : high) = middle;
  }
  return high;
}

}  // namespace

AffineFlow flow_between(const SpritePlacement& from, const SpritePlacement& to, PixelSize sensor) {
  // A point at pixel p was seen at uv - 1/2 = A0^-1 (p - c0), and is seen at c1 + A1 A0^-1 (p - c0).
  const Eigen::Matrix2d M = to.A * from.A.inverse();
  const Eigen::Vector2d middle((sensor.width - 1) / 2.0, (sensor.height - 1) / 2.0);
  return {M - Eigen::Matrix2d::Identity(), to.centre + M * (middle - from.centre) - middle};
}

AffineMotion draw_motion(const MotionMix& mix, PixelSize sensor, const AffineStart& start, double duration_s,
                         double rms_wanted_px, std::uint64_t seed, std::uint32_t number) {
  const Direction direction = draw_direction(mix, sensor, seed, number);
  const double strength = strength_for(rms_wanted_px, start, direction, sensor);
  AffineMotion motion;
  motion.poses = {go(start, direction, 0), go(start, direction, strength, direction.half_way),
                  go(start, direction, strength)};
  motion.poses[1].t_s = duration_s / 2;
  motion.poses[2].t_s = duration_s;
  motion.optical_flow_rms_px = rms_wanted_px;
  return motion;
}

MagnitudeHistogram strengths_for(const MagnitudeHistogram& target, const MotionMix& mix, PixelSize sensor) {
  constexpr std::uint64_t kSeed = 0;  // of the random numbers here: a constant of the method
  constexpr std::uint32_t kMotions = 200, kPixels = 16;
  constexpr int kIterations = 300;
  const std::size_t bins = target.bins();

  // K[a][b]; the last b is for magnitudes beyond the target's bins.
  std::vector<std::vector<double>> K(bins, std::vector<double>(bins + 1));
  const AddressedRandom random(kSeed, Purpose::dataset_choice);
  for (std::size_t a = 0; a < bins; ++a) {
    for (std::uint32_t i = 0; i < kMotions; ++i) {
      const auto number = static_cast<std::uint32_t>(a) * kMotions + i;
      const double within = (i + 0.5) / kMotions;
      const double strength_px = target.edges[a] + within * (target.edges[a + 1] - target.edges[a]);
      const AffineMotion motion = draw_motion(mix, sensor, {}, 1, strength_px, kSeed, number);
      const AffineFlow optical_flow =
          flow_between(placement(motion.poses[0], sensor), placement(motion.poses[2], sensor), sensor);
      for (std::uint32_t k = 0; k < kPixels; ++k) {
        const auto [u, v] = random.uniforms(number, k);
        const Eigen::Vector2d from_middle((u - 0.5) * sensor.width, (v - 0.5) * sensor.height);
        K[a][target.bin_of(optical_flow.at(from_middle).norm())] += 1.0 / (double{kMotions} * kPixels);
      }
    }
  }

  MagnitudeHistogram result = target;
  std::vector<double>& p = result.fractions;
  std::vector<double> made(bins), factor(bins);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::fill(made.begin(), made.end(), 0.0);
    for (std::size_t a = 0; a < bins; ++a) {
      for (std::size_t b = 0; b < bins; ++b) made[b] += p[a] * K[a][b];
    }
    for (std::size_t a = 0; a < bins; ++a) {
      factor[a] = 0;
      for (std::size_t b = 0; b < bins; ++b) factor[a] += made[b] > 0 ? K[a][b] * target.fractions[b] / made[b] : 0.0;
    }
    for (std::size_t a = 0; a < bins; ++a) p[a] *= factor[a];
  }
  const double sum = std::accumulate(p.begin(), p.end(), 0.0);
  for (double& fraction : p) fraction /= sum;
  return result;
}

}  // namespace esim::inline dataset

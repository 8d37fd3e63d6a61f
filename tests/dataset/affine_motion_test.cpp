#include "esim/dataset/generators/affine_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "esim/core/random.h"
#include "esim/dataset/generators/magnitudes.h"
#include "support/numeric.h"

namespace esim {
namespace {

constexpr PixelSize kSensor{240, 180};
constexpr AffineStart kStart{25, 0.7};

SpritePlacement placed(const AffineMotion& motion, double t_s) {
  const SpriteMotion sprite({motion.poses.begin(), motion.poses.end()}, SpriteInterpolation::spline);
  return place(sprite.at(to_ns(t_s)), SpriteUnits::pixel, {300, 200}, kSensor, {0.3, 0.6});
}

AffineFlow optical_flow(const AffineMotion& motion) {
  return flow_between(placed(motion, 0), placed(motion, 0.04), kSensor);
}

TEST(AffineMotion, IsAsStrongAsItIsToBe) {
  for (const double wanted_px : {0.05, 3.0, 40.0, 150.0}) {
    for (std::uint32_t number = 0; number < 20; ++number) {
      const AffineFlow d = optical_flow(draw_motion({}, kSensor, kStart, 0.04, wanted_px, 7, number));
      double sum = 0;
      for (int y = 0; y < kSensor.height; ++y) {
        for (int x = 0; x < kSensor.width; ++x) sum += d.at({x - 119.5, y - 89.5}).squaredNorm();
      }
      EXPECT_NEAR(std::sqrt(sum / (kSensor.width * kSensor.height)), wanted_px, 1e-4 * wanted_px);
    }
  }
}

TEST(AffineMotion, OpticalFlowIsWherePointsGo) {
  const AffineMotion motion = draw_motion({}, kSensor, kStart, 0.04, 12, 7, 3);
  const SpritePlacement from = placed(motion, 0), to = placed(motion, 0.04);
  const AffineFlow d = optical_flow(motion);
  for (const Eigen::Vector2d& uv : {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.9, 0.2), Eigen::Vector2d(-1, 3)}) {
    const Eigen::Vector2d middle(0.5, 0.5), centre(119.5, 89.5);
    const Eigen::Vector2d before = from.centre + from.A * (uv - middle), after = to.centre + to.A * (uv - middle);
    EXPECT_LT(test::largest_difference(before + d.at(before - centre), after), 1e-9);
  }
}

TEST(AffineMotion, NothingMovesWithoutStrength) {
  const AffineFlow d = optical_flow(draw_motion({}, kSensor, kStart, 0.04, 0, 7, 3));
  EXPECT_LT(d.gradient.norm() + d.at_middle.norm(), 1e-9);
}

TEST(AffineMotion, IsOfTheKindsThatTheMixNames) {
  const AffineFlow translation = optical_flow(draw_motion({1, 0, 0, 0}, kSensor, kStart, 0.04, 9, 7, 3));
  EXPECT_LT(translation.gradient.norm(), 1e-12);
  const AffineFlow turn = optical_flow(draw_motion({1e-6, 1, 0, 0}, kSensor, kStart, 0.04, 9, 7, 3));
  const Eigen::Matrix2d R = turn.gradient + Eigen::Matrix2d::Identity();
  EXPECT_LT(test::largest_difference(R * R.transpose(), Eigen::Matrix2d::Identity()), 1e-9);
  const AffineFlow growth = optical_flow(draw_motion({1e-6, 0, 1, 0}, kSensor, kStart, 0.04, 9, 7, 3));
  EXPECT_NEAR(growth.gradient(0, 0), growth.gradient(1, 1), 1e-9);
  EXPECT_NEAR(growth.gradient(0, 1), 0, 1e-9);
}

TEST(AffineMotion, PathsAreBentAndSpeedsDiffer) {
  int bent = 0;
  for (std::uint32_t number = 0; number < 50; ++number) {
    const AffineMotion motion = draw_motion({}, kSensor, kStart, 0.04, 20, 7, number);
    const Eigen::Vector2d a = placed(motion, 0).centre_velocity, b = placed(motion, 0.04).centre_velocity;
    EXPECT_LT((a - b).norm(), 0.9 * (a + b).norm()) << "but not by much";
    bent += (a - b).norm() > 0.05 * (a + b).norm() ? 1 : 0;
  }
  EXPECT_GT(bent, 25);
}

/// The histogram of pixels that sequences with these strengths have.
std::vector<double> made_by(const MagnitudeHistogram& strengths, const MotionMix& mix) {
  constexpr std::uint32_t kSequences = 4000;
  std::vector<double> counts(strengths.bins());
  const AddressedRandom random(11, Purpose::test);
  for (std::uint32_t i = 0; i < kSequences; ++i) {
    const double rms_px = strengths.quantile((i + 0.5) / kSequences);
    const AffineFlow d = optical_flow(draw_motion(mix, kSensor, kStart, 0.04, rms_px, 5, i));
    for (std::uint32_t k = 0; k < 8; ++k) {
      const auto [u, v] = random.uniforms(i, k);
      const std::size_t bin = strengths.bin_of(d.at({240 * (u - 0.5), 180 * (v - 0.5)}).norm());
      if (bin < counts.size()) counts[bin] += 1.0 / (8 * kSequences);
    }
  }
  return counts;
}

TEST(Strengths, MakePixelsFollowTheTarget) {
  const MagnitudeHistogram target = sintel_magnitudes();
  const MagnitudeHistogram strengths = strengths_for(target, {}, kSensor);
  EXPECT_NEAR(std::accumulate(strengths.fractions.begin(), strengths.fractions.end(), 0.0), 1, 1e-9);
  const double off = total_variation(made_by(strengths, {}), target.fractions);
  EXPECT_LT(off, 0.03);

  // Of mostly turning motion, which differs more over the image, the correction is what makes it fit.
  const MotionMix turning{0.3, 1, 0.5, 0.3};
  const MagnitudeHistogram narrow{{0, 5, 10, 15, 20, 40}, {0.1, 0.5, 0.3, 0.1, 0}, ""};
  const double corrected = total_variation(made_by(strengths_for(narrow, turning, kSensor), turning), narrow.fractions),
               uncorrected = total_variation(made_by(narrow, turning), narrow.fractions);
  EXPECT_LT(corrected, 0.8 * uncorrected);
}

}  // namespace
}  // namespace esim

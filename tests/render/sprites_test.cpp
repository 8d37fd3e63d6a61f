// Closed forms and slow references for the sprites of the sprites renderer.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/scenes.h"

namespace esim {
namespace {

const Camera kCamera{120, 90, 100, 100, 59.5, 44.5, NoDistortion{}};

std::shared_ptr<const Texture> constant(float value, int width = 8, int height = 8) {
  return std::make_shared<const Texture>(Image<float>(width, height, value), Wrap::clamp, Wrap::clamp);
}

/// Precision of a texture for light of up to 1.
constexpr double kTexel = 1.0 / 4096;

template <typename Function>
std::shared_ptr<const Texture> textured(int width, int height, const Function& of_uv) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(of_uv((x + 0.5) / width, (y + 0.5) / height));
  }
  return std::make_shared<const Texture>(image, Wrap::clamp, Wrap::clamp);
}

SpriteMotion linear(std::vector<SpritePose> poses) { return SpriteMotion(poses, SpriteInterpolation::linear); }

/// An opaque sprite of one brightness that moves right by 10 px/s.
Sprite plain(float light, Eigen::Vector2d scale, double velocity = 10.0) {
  return {constant(light), nullptr, SpriteUnits::pixel, SpriteBeyond::nothing,
          linear({{0, {0, 0}, 0, scale}, {1, {velocity, 0}, 0, scale}})};
}

Sample render(const SpriteScene& scene, double t_s, const Kinematics& camera = {}) {
  return test::render(*make_sprites_renderer(scene, kCamera, test::two_threads()), kCamera, camera, {}, {},
                      t_s - test::kTime_s);
}

/// Light in the image, and its centre.
struct Moments {
  double mass = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
};
Moments moments_of(const Image<float>& image) {
  Moments moments;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      moments.mass += image(x, y);
      moments.centre += double{image(x, y)} * Eigen::Vector2d(x, y);
    }
  }
  moments.centre /= moments.mass;
  return moments;
}

TEST(SpritesRenderer, ATranslatingSpriteMovesByVelocityTimesTime) {
  const Eigen::Vector2d start(-11.3, 6.2), velocity(17.7, -9.1);
  const auto blob = textured(33, 27, [](double u, double v) {
    const double r2 = (u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5);
    return std::max(0.0, 1 - 4 * r2) * std::max(0.0, 1 - 4 * r2);
  });
  for (const double rotation_deg : {0.0, 31.0}) {
    for (const double scale : {1.0, 0.6, 1.7}) {
      const double tolerance_px = scale < 1 ? 0.01 : 2e-3;  // mip levels of an odd size are not exactly centred
      const SpriteMotion motion =
          linear({{0, start, rotation_deg, {scale, scale}}, {1, start + velocity, rotation_deg, {scale, scale}}});
      for (const auto& [light, alpha] : {std::pair(blob, blob), std::pair(constant(0.8F, 33, 27), constant(1, 1, 1))}) {
        const SpriteScene scene{{{light, alpha, SpriteUnits::pixel, SpriteBeyond::nothing, motion}}, 0.0F};
        const Moments at_start = moments_of(render(scene, 0).irradiance);
        EXPECT_LT((at_start.centre - Eigen::Vector2d(59.5, 44.5) - start).norm(), tolerance_px);
        for (const double t_s : {0.01, 0.123, 0.5, 1.0}) {
          const Sample sample = render(scene, t_s);
          const Moments now = moments_of(sample.irradiance);
          EXPECT_LT((now.centre - at_start.centre - velocity * t_s).norm(), tolerance_px)
              << t_s << " s, scale " << scale;
          EXPECT_NEAR(now.mass / at_start.mass, 1.0, 2e-3);
          const auto x = static_cast<int>(std::lround(now.centre.x())),
                     y = static_cast<int>(std::lround(now.centre.y()));
          EXPECT_FLOAT_EQ(sample.motion_x(x, y), 17.7F);
          EXPECT_FLOAT_EQ(sample.motion_y(x, y), -9.1F);
          EXPECT_TRUE(std::isinf(sample.depth(x, y)));
        }
      }
    }
  }
}

TEST(SpritesRenderer, TheMotionFieldIsTheVelocityOfThePointThatIsSeen) {
  const std::vector<SpritePose> poses = {
      {0, {-20, 4}, -20, {3, 2}}, {0.4, {3, -9}, 70, {4, 5}}, {1, {22, 10}, 300, {2, 3}}};
  for (const auto units : {SpriteUnits::pixel, SpriteUnits::sensor}) {
    std::vector<SpritePose> keys = poses;
    if (units == SpriteUnits::sensor) {
      for (SpritePose& key : keys) key.position /= 100, key.scale /= 5;
    }
    const SpriteMotion motion(keys, SpriteInterpolation::spline);
    const Sprite sprite{constant(0.5F, 20, 10), nullptr, units, SpriteBeyond::clamp, motion};
    for (const double t_s : {0.1, 0.37, 0.9}) {
      const Sample sample = render({{sprite}, 0.0F}, t_s);
      const auto where = [&](double t, const Eigen::Vector2d& uv) -> Eigen::Vector2d {
        const SpritePlacement at = place(motion.at(to_ns(t)), units, {20, 10}, {120, 90});
        return at.centre + at.A * (uv - Eigen::Vector2d(0.5, 0.5));
      };
      const SpritePlacement now = place(motion.at(to_ns(t_s)), units, {20, 10}, {120, 90});
      for (int y = 0; y < 90; y += 11) {
        for (int x = 0; x < 120; x += 13) {
          const Eigen::Vector2d uv = Eigen::Vector2d(0.5, 0.5) + now.A.inverse() * (Eigen::Vector2d(x, y) - now.centre);
          const Eigen::Vector2d expected = (where(t_s + 1e-5, uv) - where(t_s - 1e-5, uv)) / 2e-5;
          EXPECT_NEAR(sample.motion_x(x, y), expected.x(), 2e-5 * (1 + expected.norm()));
          EXPECT_NEAR(sample.motion_y(x, y), expected.y(), 2e-5 * (1 + expected.norm()));
        }
      }
    }
  }
}

TEST(SpritesRenderer, TheFirstSpriteIsTheNearest) {
  const Sprite bright = plain(0.9F, {5, 5}, 10), dark = plain(0.1F, {3, 8}, -20);
  const Sample bright_first = render({{bright, dark}, 0.4F}, 0), dark_first = render({{dark, bright}, 0.4F}, 0);
  EXPECT_NEAR(bright_first.irradiance(60, 45), 0.9F, kTexel);
  EXPECT_FLOAT_EQ(bright_first.motion_x(60, 45), 10.0F);
  EXPECT_NEAR(dark_first.irradiance(60, 45), 0.1F, kTexel);
  EXPECT_FLOAT_EQ(dark_first.motion_x(60, 45), -20.0F);
  EXPECT_NEAR(bright_first.irradiance(60, 72), 0.1F, kTexel) << "beyond the bright one";
  EXPECT_NEAR(bright_first.irradiance(3, 3), 0.4F, kTexel) << "outside of both";
  EXPECT_EQ(bright_first.motion_x(3, 3), 0.0F);
}

TEST(SpritesRenderer, TheMotionFieldIsOfTheSpriteWithTheLargestWeight) {
  for (const float alpha : {0.3F, 0.45F, 0.55F, 0.8F}) {
    Sprite glass = plain(0.9F * alpha, {5, 5}, 10);
    glass.alpha = constant(alpha);
    const Sample over_sprite = render({{glass, plain(0.1F, {9, 9}, -20)}, 0.0F}, 0);
    EXPECT_FLOAT_EQ(over_sprite.motion_x(60, 45), alpha > 0.5F ? 10.0F : -20.0F) << alpha;
    EXPECT_NEAR(over_sprite.irradiance(60, 45), 0.9F * alpha + 0.1F * (1 - alpha), kTexel);
    const Sample over_background = render({{glass}, 0.5F}, 0);
    EXPECT_FLOAT_EQ(over_background.motion_x(60, 45), alpha > 0.5F ? 10.0F : 0.0F) << alpha;
    EXPECT_NEAR(over_background.irradiance(60, 45), 0.9F * alpha + 0.5F * (1 - alpha), kTexel);
  }
}

TEST(SpritesRenderer, EdgesCoverTheirShareOfEveryPixel) {
  constexpr int kFine = 64;
  for (const double rotation_deg : {0.0, 3.0, 17.0, 45.0, 90.0}) {
    const Sprite sheet{constant(1), nullptr, SpriteUnits::pixel, SpriteBeyond::nothing,
                       linear({{0, {0.37, -0.81}, rotation_deg, {6.3, 4.1}}})};
    const Sample sample = render({{sheet}, 0.0F}, 0);
    const SpritePlacement at = place(sheet.motion.at(0), sheet.units, {8, 8}, {120, 90});
    const Eigen::Matrix2d uv_from_pixel = at.A.inverse();
    double largest = 0, total = 0;
    for (int y = 0; y < 90; ++y) {
      for (int x = 0; x < 120; ++x) {
        int inside = 0;
        for (int i = 0; i < kFine * kFine; ++i) {
          const Eigen::Vector2d point(x - 0.5 + (i % kFine + 0.5) / kFine, y - 0.5 + (i / kFine + 0.5) / kFine);
          inside += (uv_from_pixel * (point - at.centre)).cwiseAbs().maxCoeff() <= 0.5;
        }
        largest = std::max(largest, std::fabs(sample.irradiance(x, y) - static_cast<double>(inside) / (kFine * kFine)));
        total += sample.irradiance(x, y);
      }
    }
    EXPECT_LT(largest, rotation_deg == 0 || rotation_deg == 90 ? 0.01 : 0.12) << rotation_deg << " (at the corners)";
    EXPECT_NEAR(total, 6.3 * 8 * 4.1 * 8, 0.2) << rotation_deg;
  }
}

TEST(SpritesRenderer, CompositesLikeASlowReference) {
  // Three sprites with smooth light and alpha; the reference evaluates their formulas at 8 x 8 points per pixel.
  const auto light = [](int i, double u, double v) { return 0.5 + 0.3 * std::sin(7 * u + i) * std::cos(5 * v - i); };
  const auto alpha = [](int i, double u, double v) {
    return 0.5 + 0.45 * std::cos(6 * u - 2 * i) * std::sin(4 * v + i);
  };
  SpriteScene scene{{}, 0.3F};
  std::vector<SpritePlacement> placements;
  for (int i = 0; i < 3; ++i) {
    const SpriteMotion motion =
        linear({{0, {9.0 * i - 12, 5.0 - 7 * i}, 25.0 * i - 10, {1.1 - 0.3 * i, 0.7 + 0.2 * i}}});
    scene.sprites.push_back({textured(80, 60, [&](double u, double v) { return light(i, u, v) * alpha(i, u, v); }),
                             textured(80, 60, [&](double u, double v) { return alpha(i, u, v); }), SpriteUnits::pixel,
                             SpriteBeyond::nothing, motion});
    placements.push_back(place(motion.at(0), SpriteUnits::pixel, {80, 60}, {120, 90}));
  }
  const Sample sample = render(scene, 0);

  constexpr int kFine = 8;
  std::vector<double> errors;
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 120; ++x) {
      double sum = 0;
      for (int k = 0; k < kFine * kFine; ++k) {
        const Eigen::Vector2d point(x - 0.5 + (k % kFine + 0.5) / kFine, y - 0.5 + (k / kFine + 0.5) / kFine);
        double behind = 0.3;
        for (int i = 2; i >= 0; --i) {
          const SpritePlacement& at = placements[static_cast<std::size_t>(i)];
          const Eigen::Vector2d from_centre = at.A.inverse() * (point - at.centre);
          if (from_centre.cwiseAbs().maxCoeff() > 0.5) continue;
          const double u = from_centre.x() + 0.5, v = from_centre.y() + 0.5, a = alpha(i, u, v);
          behind = a * light(i, u, v) + (1 - a) * behind;
        }
        sum += behind;
      }
      errors.push_back(std::fabs(sample.irradiance(x, y) - sum / (kFine * kFine)));
    }
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() * 95 / 100], 2e-3);
  EXPECT_LT(errors.back(), 0.05) << "where edges of two sprites cross a pixel";
}

TEST(SpritesRenderer, TransparentTexelsDarkenNoEdge) {
  // A white disc cut out by alpha, on black that must not be visible, in front of a white background.
  const auto disc = textured(64, 64, [](double u, double v) { return std::hypot(u - 0.5, v - 0.5) < 0.4 ? 1.0 : 0.0; });
  for (const double scale : {0.13, 0.5, 1.0, 1.6}) {
    const Sprite sprite{disc, disc, SpriteUnits::pixel, SpriteBeyond::nothing,
                        linear({{0, {1.3, 2.4}, 20, {scale, scale}}})};
    const Sample sample = render({{sprite}, 1.0F}, 0);
    for (const float value : sample.irradiance.pixels()) ASSERT_NEAR(value, 1.0, 1e-5) << scale;
  }
}

TEST(SpritesRenderer, GoesOnBeyondTheEdgesAsAsked) {
  // A ramp of 40 texels in the middle of the sensor, seen 30 texels beyond its right edge (u = 1.75).
  const auto seen = [](SpriteBeyond beyond) {
    Image<float> ramp(40, 4);
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 40; ++x) ramp(x, y) = (static_cast<float>(x) + 0.5F) / 40;
    }
    const Wrap wrap = beyond == SpriteBeyond::repeat ? Wrap::repeat : Wrap::clamp;
    const Sprite sprite{std::make_shared<const Texture>(ramp, wrap, wrap), nullptr, SpriteUnits::pixel, beyond,
                        linear({{0, {-10, 0.5}, 0, {1, 1}}})};
    return render({{sprite}, 0.123F}, 0).irradiance(99, 45);
  };
  EXPECT_NEAR(seen(SpriteBeyond::nothing), 0.123, 1e-6);
  EXPECT_NEAR(seen(SpriteBeyond::clamp), 1.0 - 0.5 / 40, kTexel);
  EXPECT_NEAR(seen(SpriteBeyond::mirror), 0.2625, 0.02);
  EXPECT_NEAR(seen(SpriteBeyond::repeat), 0.7375, 0.02);
}

TEST(SpritesRenderer, DoesNotSeeTheCameraMove) {
  const Sample a = render(test::test_sprites(), 0.2), b = render(test::test_sprites(), 0.2, test::moving_camera());
  EXPECT_TRUE(std::ranges::equal(a.irradiance.pixels(), b.irradiance.pixels()));
  EXPECT_TRUE(std::ranges::equal(a.motion_x.pixels(), b.motion_x.pixels()));
  EXPECT_TRUE(make_sprites_renderer(test::test_sprites(), kCamera, test::two_threads())->traits().on_sensor);
}

TEST(SpritesRenderer, DegenerateSpritesAreNotSeenAndLeaveNumbersFinite) {
  for (const auto beyond : {SpriteBeyond::nothing, SpriteBeyond::clamp, SpriteBeyond::mirror, SpriteBeyond::repeat}) {
    for (const Eigen::Vector2d& scale : {Eigen::Vector2d(0, 1), Eigen::Vector2d(0, 0), Eigen::Vector2d(1e-5, 1e6),
                                         Eigen::Vector2d(1e6, 1e6), Eigen::Vector2d(-2, 3)}) {
      for (const double away : {0.0, 1e6}) {
        const Sprite sprite{constant(0.5F), constant(0.5F), SpriteUnits::pixel, beyond,
                            linear({{0, {away, -away}, 33, scale}, {1, {0, 0}, -1e9, {1, 1}}})};
        const Sample sample = render({{sprite}, 0.25F}, 0);
        for (const auto* field : {&sample.irradiance, &sample.motion_x, &sample.motion_y}) {
          EXPECT_TRUE(std::ranges::all_of(field->pixels(), [](float value) { return std::isfinite(value); }));
        }
        EXPECT_TRUE(std::ranges::all_of(sample.irradiance.pixels(), [](float e) { return e > 0.24F && e < 0.64F; }));
      }
    }
  }
}

}  // namespace
}  // namespace esim

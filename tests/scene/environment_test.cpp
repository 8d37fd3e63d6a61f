// Environments against integration over their images.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "esim/core/error.h"
#include "esim/scene/environment/environment.h"
#include "esim/scene/environment/split_sum.h"
#include "support/sanitizers.h"

namespace esim {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr const char* kLong = "takes a minute under sanitizers, where IsContinuousEverywhere runs the same code";

Vector3d direction_at(const Image<float>& image, int x, int y) {
  const double longitude = kPi - 2 * kPi * (x + 0.5) / image.width(),
               latitude = kPi * (0.5 - (y + 0.5) / image.height());
  return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
}

/// A sky with a sun of a few degrees, 50 times as bright.
Image<float> sky(int height) {
  Image<float> image(2 * height, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      const Vector3d d = direction_at(image, x, y);
      const double off = std::acos(std::clamp(d.dot(Vector3d(0.3, -0.7, 0.6).normalized()), -1.0, 1.0));
      image(x, y) =
          static_cast<float>(0.5 + 0.4 * d.z() + 0.2 * d.x() * d.y() + 20 * std::exp(-std::pow(off / 0.08, 2)));
    }
  }
  return image;
}

/// The mean over the image, weighted by weight(direction) and the solid angle.
template <typename Weight>
double mean(const Image<float>& image, const Weight& weight) {
  double sum = 0, weights = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double w = std::cos(kPi * (0.5 - (y + 0.5) / image.height())) * weight(direction_at(image, x, y));
      sum += w * double{image(x, y)}, weights += w;
    }
  }
  return sum / weights;
}

std::vector<Vector3d> directions() {
  std::vector<Vector3d> all = {{0, 0, 1}, {0, 0, -1}, {-1, 0, 0}, {0.3, -0.7, 0.6}, {0.5, 0.5, 0}};
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < 12; ++i) all.emplace_back(normal(random), normal(random), normal(random));
  for (Vector3d& d : all) d.normalize();
  return all;
}

TEST(Environment, IsPrefilteredForDiffuseSurfaces) {
  const Image<float> image = sky(128);
  const Environment environment({image}, 2, 0, "sky");
  for (const Vector3d& n : directions()) {
    const double expected = 2 * mean(image, [&](const Vector3d& d) { return std::max(d.dot(n), 0.0); });
    const Eigen::Vector3f f = 3 * n.cast<float>();
    EXPECT_NEAR(environment.diffuse(0, f.x(), f.y(), f.z()), expected, 0.01 * expected);
  }
}

TEST(Environment, IsPrefilteredForEachRoughness) {
  if (test::kSanitized) GTEST_SKIP() << kLong;
  const Image<float> image = sky(256);
  const Environment environment({image}, 1, 0, "sky");
  for (const double roughness : {0.25, 0.375, 0.5, 0.75, 1.0}) {
    double squares = 0;
    for (const Vector3d& n : directions()) {
      const double a2 = std::pow(roughness, 4);
      const double expected = mean(image, [&](const Vector3d& l) {
        const double n_l = n.dot(l), n_h = n.dot((n + l).normalized());
        return n_l > 0 ? n_l * a2 / std::pow(n_h * n_h * (a2 - 1) + 1, 2) : 0;
      });
      const Eigen::Vector3f f = n.cast<float>();
      const double found = environment.specular(0, f.x(), f.y(), f.z(), static_cast<float>(roughness));
      squares += std::pow(found / expected - 1, 2);
    }
    const auto count = static_cast<double>(directions().size());
    EXPECT_LT(std::sqrt(squares / count), 0.02) << roughness;
  }
}

TEST(Environment, IsContinuousEverywhere) {
  const Environment environment({sky(64)}, 1, 0.4, "sky");
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  const auto at = [&](const Vector3d& d, float roughness) {
    const Eigen::Vector3f f = d.cast<float>();
    return double{environment.specular(0, f.x(), f.y(), f.z(), roughness)};
  };
  constexpr double kStep = 1e-4;
  for (const Vector3d& axis : {Vector3d(0, 0, 1), Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(1, 1, 0)}) {
    Vector3d across = axis.unitOrthogonal();
    for (int i = 0; i < 62832; i += 7) {
      // Great circles through the poles, the equator and the image's seam: steps grow with the step only.
      const Vector3d a = Eigen::AngleAxisd(i * kStep, axis.normalized()) * across;
      const Vector3d b = Eigen::AngleAxisd((i + 1) * kStep, axis.normalized()) * across;
      for (const float roughness : {0.0F, 0.3F, 0.9F}) ASSERT_NEAR(at(a, roughness), at(b, roughness), 400 * kStep);
      ASSERT_NEAR(at(a, 0.4999F), at(a, 0.5001F), 0.01);
    }
  }
}

TEST(Environment, TurnsCounterclockwise) {
  if (test::kSanitized) GTEST_SKIP() << kLong;
  const Image<float> image = sky(128);
  const Environment environment({image}, 1, 0, "sky"), turned({image}, 1, kPi / 2, "sky");
  for (const Vector3d& d : directions()) {
    const Eigen::Vector3f f = d.cast<float>();
    for (const float roughness : {0.0F, 0.6F}) {
      EXPECT_NEAR(turned.specular(0, -f.y(), f.x(), f.z(), roughness),
                  environment.specular(0, f.x(), f.y(), f.z(), roughness),
                  0.02 * (1 + environment.specular(0, f.x(), f.y(), f.z(), roughness)));
    }
  }
}

TEST(Environment, HasAViewPerColour) {
  if (test::kSanitized) GTEST_SKIP() << kLong;
  Planes planes(3, Image<float>(64, 32));
  for (std::size_t c = 0; c < 3; ++c) {
    for (float& value : planes[c].pixels()) value = static_cast<float>(c + 1);
  }
  const Environment coloured(planes, 0.5F, 0, "sky"), grey({planes[1]}, 0.5F, 0, "sky");
  const auto at = [](const Environment& environment, std::size_t view) {
    return environment.diffuse(view, 0.1F, 0.2F, 1);
  };
  EXPECT_NEAR(at(coloured, 0), 0.5F * luminance(1, 2, 3), 1e-5F);
  for (std::size_t view = 1; view < 4; ++view) EXPECT_NEAR(at(coloured, view), 0.5F * static_cast<float>(view), 1e-5F);
  EXPECT_EQ(at(grey, 2), at(grey, 0));
}

TEST(Environment, RefusesLightThatCannotBe) {
  for (const float value : {-0.1F, std::nanf(""), HUGE_VALF}) {
    Image<float> image(64, 32);
    for (float& pixel : image.pixels()) pixel = 1;
    image(3, 4) = value;
    EXPECT_THROW(Environment({image}, 1, 0, "sky"), UserError) << value;
  }
  EXPECT_THROW(load_environment("/no/such/sky.hdr", 1, 0, false), UserError);
}

TEST(SplitSum, IsTheIntegralOfTheModel) {
  // By a fine grid over the directions of light.
  for (const double roughness : {0.25, 0.5, 0.8, 1.0}) {
    for (const double cosine : {0.15, 0.5, 0.95}) {
      const double a2 = std::pow(roughness, 4);
      const Vector3d v(std::sqrt(1 - cosine * cosine), 0, cosine);
      double scale = 0, offset = 0;
      constexpr int kFine = 600;
      for (int i = 0; i < kFine; ++i) {
        for (int j = 0; j < kFine; ++j) {
          const double z = (i + 0.5) / kFine, longitude = kPi * (j + 0.5) / kFine, rho = std::sqrt(1 - z * z);
          const Vector3d l(rho * std::cos(longitude), rho * std::sin(longitude), z), h = (l + v).normalized();
          const double D = a2 / (kPi * std::pow(h.z() * h.z() * (a2 - 1) + 1, 2));
          const double V =
              0.5 / (z * std::sqrt(cosine * cosine * (1 - a2) + a2) + cosine * std::sqrt(z * z * (1 - a2) + a2));
          const double f = D * V * z * 2 * kPi / (kFine * kFine), schlick = std::pow(1 - v.dot(h), 5);
          scale += f * (1 - schlick), offset += f * schlick;
        }
      }
      const auto [a, b] = SplitSum::table().at(static_cast<float>(cosine), static_cast<float>(roughness));
      EXPECT_NEAR(a, scale, 4e-3) << roughness << ", " << cosine;
      EXPECT_NEAR(b, offset, 2e-3) << roughness << ", " << cosine;
    }
  }
}

}  // namespace
}  // namespace esim

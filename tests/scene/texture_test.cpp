#include "esim/scene/images/texture.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr int kLanes = 8;

TextureLookup<kLanes> lookup(float u, float v, float du_dx, float dv_dx, float du_dy, float dv_dy) {
  TextureLookup<kLanes> at;
  at.u.fill(u), at.v.fill(v);
  at.du_dx.fill(du_dx), at.dv_dx.fill(dv_dx), at.du_dy.fill(du_dy), at.dv_dy.fill(dv_dy);
  return at;
}

Image<float> noise(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform;
  Image<float> image(width, height);
  for (float& value : image.pixels()) value = uniform(random);
  return image;
}

TEST(Texture, ASmallFootprintInterpolatesTexels) {
  const Image<float> texels = noise(16, 8, 1);
  const Texture texture(texels, Wrap::repeat, Wrap::clamp);
  const float tiny = 1e-4F;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      const float u = (static_cast<float>(x) + 0.5F) / 16, v = (static_cast<float>(y) + 0.5F) / 8;
      EXPECT_NEAR(texture.sample(lookup(u, v, tiny, 0, 0, tiny))[0], texels(x, y), 3e-4);
      EXPECT_NEAR(texture.sample(lookup(u + 3, v, tiny, 0, 0, tiny))[0], texels(x, y), 3e-4) << "repeats";
      const float halfway = texture.sample(lookup(u + 0.5F / 16, v, tiny, 0, 0, tiny))[0];
      EXPECT_NEAR(halfway, 0.5F * (texels(x, y) + texels((x + 1) % 16, y)), 3e-4);
    }
  }
  EXPECT_NEAR(texture.sample(lookup(0.5F / 16, -0.4F, tiny, 0, 0, tiny))[0], texels(0, 0), 3e-4) << "clamps";
}

/// The texel that continues a row or column.
int continued(int i, int size, Wrap wrap) {
  return wrap == Wrap::clamp ? std::clamp(i, 0, size - 1) : (i % size + size) % size;
}

/// The 4 x 4 taps of a footprint of two by two texels, one after another.
double mean_of_taps(const Image<float>& texels, float u, float v, Wrap wrap_u, Wrap wrap_v) {
  const hwy::HWY_NAMESPACE::CappedTag<float, 1> d;
  namespace hn = hwy::HWY_NAMESPACE;
  const BoxFilter filter(d, hn::Set(d, 4.0F), hn::Zero(d));
  const auto taps = [&](float coordinate, int size, Wrap wrap) {
    const float part = wrap == Wrap::repeat ? coordinate - std::floor(coordinate) : coordinate;
    const float x = part * static_cast<float>(size) - 0.5F;
    const auto w = filter.weights(hn::Set(d, x - std::floor(x)));
    std::array<std::pair<int, float>, 4> out;
    const std::array<float, 4> weights{hn::GetLane(w.first), hn::GetLane(w.second), hn::GetLane(w.third),
                                       hn::GetLane(w.fourth)};
    for (int i = 0; i < 4; ++i) {
      const int tap = static_cast<int>(std::floor(x)) - 1 + i;
      out[static_cast<std::size_t>(i)] = {continued(tap, size, wrap), weights[static_cast<std::size_t>(i)]};
    }
    return out;
  };
  double sum = 0;
  for (const auto& [y, down] : taps(v, texels.height(), wrap_v)) {
    for (const auto& [x, across] : taps(u, texels.width(), wrap_u)) sum += double{down} * double{across} * texels(x, y);
  }
  return sum;
}

TEST(Texture, EqualsItsTapsAcrossBlocksAndEdges) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> anywhere(-1.2F, 2.2F);
  const std::array<std::pair<int, int>, 9> sizes{
      {{1, 1}, {1, 200}, {200, 1}, {25, 57}, {26, 58}, {29, 61}, {32, 64}, {61, 130}, {333, 100}}};
  for (const auto& [width, height] : sizes) {
    const Image<float> texels = noise(width, height, 6);
    for (const Wrap wrap_u : {Wrap::repeat, Wrap::clamp}) {
      for (const Wrap wrap_v : {Wrap::repeat, Wrap::clamp}) {
        const Texture texture(texels, wrap_u, wrap_v);
        const Image<float> kept = texture.texels();
        for (int i = 0; i < 300; ++i) {
          const float u = anywhere(random), v = anywhere(random);
          const float found =
              texture.sample(lookup(u, v, 2 / static_cast<float>(width), 0, 0, 2 / static_cast<float>(height)))[0];
          EXPECT_NEAR(found, mean_of_taps(kept, u, v, wrap_u, wrap_v), 2e-4)
              << width << " x " << height << " texels at " << u << ", " << v;
        }
        for (std::size_t i = 0; i < texels.size(); ++i) EXPECT_NEAR(kept.pixels()[i], texels.pixels()[i], 2e-4);
      }
    }
  }
}

TEST(Texture, RefusesStripsThatTakeTooMuchMemory) {
  EXPECT_THROW(Texture(Image<float>(6'000'000, 2), Wrap::repeat, Wrap::repeat), UserError);
}

TEST(Texture, ALargeFootprintAverages) {
  const Image<float> texels = noise(256, 256, 2);
  const Texture texture(texels, Wrap::repeat, Wrap::repeat);
  double mean = 0;
  for (const float value : texels.pixels()) mean += value / static_cast<double>(texels.size());
  EXPECT_NEAR(texture.sample(lookup(0.3F, 0.7F, 4, 0, 0, 4))[3], mean, 1e-4);
  EXPECT_NEAR(texture.sample(lookup(0.3F, 0.7F, 40, 0, 0, 9))[3], mean, 1e-4);
}

TEST(Texture, EveryLevelKeepsTheMeanAlsoOfOddSizes) {
  Image<float> texels(37, 23, 1.0F);
  for (int y = 0; y < 23; ++y) texels(36, y) = 5.0F;
  const Texture texture(texels, Wrap::clamp, Wrap::clamp);
  EXPECT_NEAR(texture.sample(lookup(0.5F, 0.5F, 1, 0, 0, 1))[0], 1.0 + 4.0 / 37, 0.02);
}

TEST(Texture, DoesNotAliasAlongALongFootprint) {
  // Stripes across u at a grazing angle: a footprint of 4 x 1 texels along u averages them, one along v does not.
  Image<float> stripes(256, 256);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) stripes(x, y) = x % 2 == 0 ? 0.0F : 1.0F;
  }
  const Texture texture(stripes, Wrap::repeat, Wrap::repeat);
  const float texel = 1.0F / 256;
  for (const float u : {0.1F, 0.1F + 0.3F * texel, 0.1F + 0.9F * texel}) {
    EXPECT_NEAR(texture.sample(lookup(u, 0.5F, 4 * texel, 0, 0, texel))[0], 0.5, 0.08);
  }
  const float across = texture.sample(lookup(100.5F * texel, 0.5F, texel, 0, 0, 4 * texel))[0];
  EXPECT_NEAR(across, 0.25, 0.05) << "the mean of the interpolation over one texel";
}

/// Amplitude of a sine of `cycles` along the whole texture, relative to that of the texture, seen by footprints with
/// the sides a and b, in texels.
double modulation(const Texture& texture, int cycles, Eigen::Vector2f a, Eigen::Vector2f b) {
  const auto size = static_cast<float>(texture.width());
  constexpr int kPositions = 600;
  std::complex<double> sum = 0;
  for (int i = 0; i < kPositions; ++i) {
    // Evenly distributed over the period and over the positions between texels.
    const double u = std::fmod(0.5 * (std::sqrt(5.0) - 1) * i, 1.0), v = std::fmod((std::sqrt(2.0) - 1) * i, 1.0);
    const float seen = texture.sample(lookup(static_cast<float>(u), static_cast<float>(v), a.x() / size, a.y() / size,
                                             b.x() / size, b.y() / size))[0];
    sum += double{seen} * std::polar(1.0, -2 * std::numbers::pi * cycles * u);
  }
  constexpr double kAmplitude = 0.45;
  return 2 * std::abs(sum) / kPositions / kAmplitude;
}

TEST(Texture, ShowsSinesAsParallelogramsDo) {
  constexpr int kTexels = 512;
  const auto sinc = [](double x) { return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); };
  for (const int cycles : {3, 8, 16, 31, 55, 90, 120}) {
    Image<float> sine(kTexels, kTexels);
    for (int y = 0; y < kTexels; ++y) {
      for (int x = 0; x < kTexels; ++x)
        sine(x, y) = 0.5F + 0.45F * static_cast<float>(std::sin(2 * std::numbers::pi * cycles * (x + 0.5) / kTexels));
    }
    const Texture texture(sine, Wrap::repeat, Wrap::repeat);
    const double per_texel = static_cast<double>(cycles) / kTexels;
    for (const double period_px : {1.0, 1.3, 1.6, 2.0, 2.4, 3.0, 3.3, 5.0, 9.0}) {
      for (const double angle_deg : {0.0, 17.0, 45.0, 80.0}) {
        for (const double elongation : {1.0, 2.5, 6.0}) {
          const double angle = angle_deg * std::numbers::pi / 180;
          Eigen::Vector2d a(elongation * std::cos(angle), elongation * std::sin(angle));
          Eigen::Vector2d b(-std::sin(angle), std::cos(angle));
          const double scale = 1 / (period_px * per_texel * std::hypot(a.x(), b.x()));
          a *= scale, b *= scale;
          const double interpolation = std::pow(sinc(per_texel), 2);
          const double exact = interpolation * std::fabs(sinc(per_texel * a.x()) * sinc(per_texel * b.x()));
          const double seen = modulation(texture, cycles, a.cast<float>(), b.cast<float>());
          const testing::Message where = testing::Message()
                                         << "texels per period " << 1 / per_texel << ", px per period " << period_px
                                         << ", " << angle_deg << " deg, sides 1 : " << elongation << ", exact " << exact
                                         << ", seen " << seen;
          if (period_px >= 3)
            EXPECT_NEAR(seen / exact, 1, 0.05) << where;
          else
            EXPECT_LE(seen, exact + (period_px > 1 ? 0.08 : 0.16)) << where;
        }
      }
    }
  }
}

TEST(Texture, SurvivesDegenerateFootprints) {
  const Texture texture(noise(64, 64, 3), Wrap::repeat, Wrap::clamp);
  for (const float huge : {0.0F, 1e-30F, 1e6F, 1e20F}) {
    const float value = texture.sample(lookup(0.2F, 0.3F, huge, 0, 0, huge))[0];
    EXPECT_TRUE(value >= 0 && value <= 1) << huge;
  }
}

TEST(Texture, KeepsLightOfAnyStrengthToTwelveBits) {
  for (const float brightest : {1e-20F, 0.7F, 1.0F, 3e4F, 1e30F, std::numeric_limits<float>::max()}) {
    Image<float> texels(100, 1);
    for (int x = 0; x < 100; ++x) texels(x, 0) = brightest * std::pow(0.82F, static_cast<float>(x));  // to 3e-9
    const Image<float> kept = Texture(texels, Wrap::repeat, Wrap::repeat).texels();
    for (int x = 0; x < 100; ++x)
      ASSERT_NEAR(kept(x, 0) / brightest, texels(x, 0) / brightest, texels(x, 0) / brightest / 4096) << x;
  }
}

TEST(Texture, KeepsRoundValuesExactly) {
  const Texture texture(Image<float>(5, 5, 1.0F), Wrap::clamp, Wrap::repeat);
  EXPECT_EQ(texture.sample(lookup(0.3F, 0.3F, 0.1F, 0, 0, 0.1F))[0], 1.0F);
}

TEST(Texture, TakesLightThatIsNoneAsDark) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Image<float> texels(4, 1, 1.0F);
  texels(0, 0) = -3, texels(1, 0) = std::numeric_limits<float>::quiet_NaN(), texels(2, 0) = kInfinity;
  const Image<float> kept = Texture(texels, Wrap::repeat, Wrap::repeat).texels();
  EXPECT_EQ(kept(1, 0), kept(0, 0));
  EXPECT_TRUE(std::isfinite(kept(2, 0)) && kept(2, 0) > 1e38F);
  EXPECT_NEAR(Texture(Image<float>(3, 3, 0.0F), Wrap::clamp, Wrap::clamp).texels()(1, 1), 0, 1e-9);
}

TEST(Texture, CoordinatesThatAreNotNumbersGiveColoursOfTheTexture) {
  for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
    Image<float> texels = noise(33, 17, 4);
    for (float& texel : texels.pixels()) texel = 2 + texel;  // memory around it contains other values, such as 0
    const Texture texture(texels, wrap, wrap);
    const auto expect_of_the_texture = [&](const std::array<float, kLanes>& colours, float bad) {
      for (const float colour : colours) EXPECT_TRUE(colour >= 1.999F && colour <= 3.001F) << colour << " at " << bad;
    };
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1e38F}) {
      expect_of_the_texture(texture.sample(lookup(bad, 0.5F, 0.1F, 0, 0, 0.1F)), bad);
      expect_of_the_texture(texture.sample(lookup(0.5F, bad, bad, bad, bad, bad)), bad);
    }
  }
}

TEST(Texture, ComputesTheLanesThatAreWanted) {
  const Texture texture(noise(64, 64, 5), Wrap::repeat, Wrap::repeat);
  TextureLookup<16> at;
  for (unsigned i = 0; i < 16; ++i) {
    at.u[i] = 0.07F * static_cast<float>(i), at.v[i] = 0.3F;
    at.du_dx[i] = 0.01F * static_cast<float>(i), at.dv_dx[i] = 0, at.du_dy[i] = 0, at.dv_dy[i] = 0.01F;
  }
  const auto all = texture.sample(at);
  for (const std::uint32_t lanes : {1U, 0x80U, 0x100U, 0x8000U, 0x0660U}) {
    const auto some = texture.sample(at, lanes);
    for (unsigned i = 0; i < 16; ++i) {
      EXPECT_TRUE((lanes >> i & 1U) == 0 || some[i] == all[i]) << i;
    }
  }
}

}  // namespace
}  // namespace esim

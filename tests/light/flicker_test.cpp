#include "esim/light/flicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace esim {
namespace {

constexpr double kDark = 0.01;
const FlickerOptions kMains{.frequency_hz = 100, .depth = 0.5};
const Workers kWorkers(2);

Image<float> image_of(int width, int height, float first, float step) {
  Image<float> image(width, height);
  for (float& pixel : image.pixels()) pixel = first, first += step;
  return image;
}

/// A divided segment with its own irradiance.
struct Divided {
  Tile tile;
  TimeNs t0, t1;
  std::vector<float> before, after;
};

std::vector<float> pixels_of(const ImageView<float>& view, const Tile& tile) {
  std::vector<float> pixels;
  for (int y = tile.y; y < tile.y + tile.height; ++y)
    pixels.insert(pixels.end(), view.row(y) + tile.x, view.row(y) + tile.x + tile.width);
  return pixels;
}

/// Divides segments, and checks that the watermarks are valid.
std::vector<Divided> divide(
    Flicker& flicker, std::span<const Segment> segments, TimeNs watermark,
    const Flicker::RenderObjects& render = [](TimeNs, const Tile&, Sample&) { FAIL(); }) {
  std::vector<Divided> all;
  TimeNs last = std::numeric_limits<TimeNs>::min();
  std::vector<TimeNs> watermarks;
  std::vector<std::size_t> ends;
  flicker.look(segments, 1000, 1000, render);
  flicker.divide(watermark, kWorkers, [&](std::span<const Segment> some, TimeNs until) {
    for (const Segment& segment : some) {
      const Tile& tile = segment.tile;
      all.push_back(
          {tile, segment.t0, segment.t1, pixels_of(segment.irradiance0, tile), pixels_of(segment.irradiance1, tile)});
    }
    EXPECT_GE(until, last);
    last = until;
    watermarks.push_back(until), ends.push_back(all.size());
  });
  EXPECT_EQ(last, watermark);
  for (std::size_t k = 0; k < ends.size(); ++k) {
    for (std::size_t i = ends[k]; i < all.size(); ++i) EXPECT_GE(all[i].t0, watermarks[k]);
  }
  return all;
}

TEST(Flicker, MultipliesSegmentsThatStayContiguous) {
  const Modulation modulation(kMains, 0, {1e-3, kDark});
  Flicker flicker(SceneLight(modulation), kDark);
  const Tile whole{0, 0, 7, 5};
  const Image<float> first = image_of(7, 5, 0.1F, 0.02F), second = image_of(7, 5, 0.5F, -0.01F);
  const std::vector<Segment> segments = {{whole, 0, 0, &first, &first},
                                         {whole, 0, 4 * kNsPerMs, &first, &second},
                                         {whole, 4 * kNsPerMs, 13 * kNsPerMs, &second, &first}};
  const std::vector<Divided> divided = divide(flicker, segments, 13 * kNsPerMs);
  ASSERT_GT(divided.size(), 30U);
  EXPECT_EQ(divided[0].t0, divided[0].t1);
  for (std::size_t i = 1; i < divided.size(); ++i) {
    EXPECT_EQ(divided[i].t0, divided[i - 1].t1);
    EXPECT_LT(divided[i].t0, divided[i].t1);
    EXPECT_EQ(divided[i].before, divided[i - 1].after);
  }
  EXPECT_EQ(divided.back().t1, 13 * kNsPerMs);
  for (const Divided& part : divided) {
    const bool early = part.t1 <= 4 * kNsPerMs;
    const Image<float>&from = early ? first : second, &to = early ? second : first;
    const double s = early ? static_cast<double>(part.t1) / 4e6 : static_cast<double>(part.t1 - 4'000'000) / 9e6;
    for (std::size_t k = 0; k < part.after.size(); ++k) {
      const double a = from.pixels()[k], b = to.pixels()[k];
      const double e = std::exp((1 - s) * std::log(a + kDark) + s * std::log(b + kDark)) - kDark;
      EXPECT_NEAR(part.after[k], e * modulation.at(part.t1), 2e-6);
    }
  }
}

TEST(Flicker, PassesManySegmentsOnInPartsWithValidWatermarks) {
  Flicker flicker(SceneLight(Modulation(kMains, 0, {1e-3, kDark})), kDark);
  const Image<float> image = image_of(500, 400, 0.1F, 1e-6F);
  const Tile left{0, 0, 200, 400}, right{200, 0, 300, 400};
  const std::vector<Segment> segments = {{left, 0, 0, &image, &image},
                                         {left, 0, 20 * kNsPerMs, &image, &image},
                                         {right, 0, 0, &image, &image},
                                         {right, 0, 15 * kNsPerMs, &image, &image}};
  const std::vector<Divided> divided = divide(flicker, segments, 15 * kNsPerMs);
  std::map<int, TimeNs> ends;
  for (const Divided& part : divided) {
    if (part.t0 > 0) {
      EXPECT_EQ(ends[part.tile.x], part.t0);
    }
    ends[part.tile.x] = part.t1;
  }
  EXPECT_EQ(ends[0], 20 * kNsPerMs);
  EXPECT_EQ(ends[200], 15 * kNsPerMs);
}

TEST(Flicker, GivesObjectsThatAreLightsTheirOwn) {
  const Modulation own({1000, 1, FlickerShape::pwm, 0.5, 0}, 0, {}), scene(kMains, 0, {1e-3, kDark});
  SceneLight light(scene);
  light.add_source(3, own);
  EXPECT_EQ(light.at(300, 3), own.at(300));
  EXPECT_EQ(light.at(300, 2), scene.at(300));
  EXPECT_EQ(light.at(300, 60000), scene.at(300));
  Flicker flicker(std::move(light), kDark);
  // Pixel 0 sees object 3, pixel 1 comes to see it, pixel 2 sees another one.
  const Tile tile{10, 20, 3, 1};
  const auto render = [&](TimeNs t, const Tile& where, Sample& sample) {
    EXPECT_EQ(where, tile);
    sample.resize(1000, 1000, true);
    sample.object.fill(9);
    sample.object(10, 20) = 3;
    sample.object(11, 20) = t > 0 ? 3 : 0;
    sample.object(12, 20) = 2;
  };
  const std::vector<float> e = {0.5F, 0.5F, 0.5F};
  const ImageView<float> view(e.data(), tile);
  const std::vector<Segment> opening = {{tile, 0, 0, view, view}}, next = {{tile, 0, 4'250'000, view, view}};
  divide(flicker, opening, 0, render);
  const std::vector<Divided> divided = divide(flicker, next, 4'250'000, render);
  EXPECT_EQ(flicker.light_of(0).before(11, 20), 0);
  EXPECT_EQ(flicker.light_of(0).after(11, 20), 3);
  for (const Divided& part : divided) {
    const double s = static_cast<double>(part.t1) / 4'250'000;
    EXPECT_NEAR(part.after[0], 0.5 * own.at(part.t1), 1e-6);
    EXPECT_NEAR(part.after[1], 0.5 * ((1 - s) * scene.at(part.t1) + s * own.at(part.t1)), 1e-6);
    EXPECT_NEAR(part.after[2], 0.5 * scene.at(part.t1), 1e-6);
  }
  Sample truth;
  render(0, tile, truth);
  truth.irradiance.fill(0.25F);
  flicker.illuminate(600'000, truth.object, truth.irradiance);
  EXPECT_EQ(truth.irradiance(10, 20), 0);
  EXPECT_NEAR(truth.irradiance(12, 20), 0.25 * scene.at(600'000), 1e-6);
}

TEST(Flicker, KeepsInvalidIrradianceInvalid) {
  Flicker flicker(SceneLight(Modulation(kMains, 0, {1e-3, kDark})), kDark);
  const std::vector<float> good = {0.5F, 0.5F}, bad = {std::nanf(""), -1.0F};
  const Tile tile{0, 0, 2, 1};
  const std::vector<Segment> segments = {{tile, 0, 5'000'000, {good.data(), tile}, {bad.data(), tile}}};
  const std::vector<Divided> divided = divide(flicker, segments, 5'000'000);
  EXPECT_TRUE(std::isnan(divided.back().after[0]));
  EXPECT_LT(divided.back().after[1], 0);
}

}  // namespace
}  // namespace esim

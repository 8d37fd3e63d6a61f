// Cameras with colour filters, in every renderer that supports colours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/scenes.h"

namespace esim {
namespace {

const char* const kColourful[] = {"panorama", "plane", "mesh", "moving mesh", "smooth mesh", "lit mesh"};

/// Different patterns with a size of a few texels: red, green, blue, and a fourth one.
std::shared_ptr<const Texture> pattern(int which) {
  Image<float> image(256, 128);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x)
      image(x, y) = static_cast<float>(0.5 + 0.4 * std::sin(0.3 * (which + 1) * x + 0.2 * (4 - which) * y + which));
  }
  return std::make_shared<const Texture>(image, Wrap::repeat, Wrap::repeat);
}
const std::array<std::shared_ptr<const Texture>, 4> kPatterns = {pattern(0), pattern(1), pattern(2), pattern(3)};
const ColourTextures kColours = {kPatterns[0], kPatterns[1], kPatterns[2]};

/// A texture with this luminance and, if they are given, these colours.
std::unique_ptr<Renderer> make(const std::string& name, const std::shared_ptr<const Texture>& luminance,
                               const ColourTextures& colours, const Camera& model, ColourFilters filters,
                               const Workers& workers = test::two_threads()) {
  if (name == "panorama") return make_panorama_renderer({luminance, {0, 0, 0, 1}, colours}, model, workers, filters);
  if (name == "plane") {
    TexturedPlane plane = test::test_plane();
    plane.radiance = luminance;
    plane.colours = colours;
    return make_plane_renderer(plane, model, workers, filters);
  }
  Scene scene = name == "moving mesh" ? test::moving_scene() : still_scene(test::box_mesh());
  for (SceneObject& object : scene.objects) {
    object.mesh.materials[0].texture = luminance;
    if (colours[0] == nullptr) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      object.mesh.coloured[i] = object.mesh.materials;
      object.mesh.coloured[i][0].texture = colours[i];
    }
  }
  if (name == "lit mesh") scene.lighting = Lighting{.ambient = 0.2F, .suns = {}, .points = {{{0, 0, 1}, 2.0F}}};
  const RaycastOptions options{0.2F, name == "smooth mesh" ? 16 : 1};
  return make_raycast_renderer(build_raycast_scene(scene), options, model, workers, filters);
}

class EveryColourfulRenderer : public testing::TestWithParam<const char*> {
 protected:
  Sample seen(Renderer& renderer, std::vector<Tile> tiles = {}) const {
    return test::render(renderer, model_, test::moving_camera(), test::objects_of(GetParam()), std::move(tiles));
  }
  Sample seen(const std::shared_ptr<const Texture>& luminance, const ColourTextures& colours,
              ColourFilters filters) const {
    return seen(*make(GetParam(), luminance, colours, model_, filters));
  }

  const Camera model_ = test::distorted_camera(1);
};

TEST_P(EveryColourfulRenderer, APixelSeesItsColourAsAGreyCameraSeesAWorldOfThatColour) {
  const Sample mosaic = seen(kPatterns[3], kColours, ColourFilters::rggb);
  for (std::size_t colour = 0; colour < 3; ++colour) {
    const Sample grey = seen(kPatterns[colour], {}, ColourFilters::none);
    EXPECT_TRUE(std::ranges::equal(mosaic.depth.pixels(), grey.depth.pixels()));
    EXPECT_TRUE(std::ranges::equal(mosaic.motion_x.pixels(), grey.motion_x.pixels()));
    for (int y = 0; y < model_.height; ++y) {
      for (int x = 0; x < model_.width; ++x) {
        if (static_cast<std::size_t>(x % 2 + y % 2) != colour) continue;
        ASSERT_EQ(mosaic.irradiance(x, y), grey.irradiance(x, y)) << colour << " at " << x << ", " << y;
      }
    }
  }
}

TEST_P(EveryColourfulRenderer, AGreyCameraNextToItSeesLuminanceWithoutColours) {
  const Sample with = seen(kPatterns[3], kColours, ColourFilters::none);
  const Sample without = seen(kPatterns[3], {}, ColourFilters::none);
  EXPECT_TRUE(std::ranges::equal(with.irradiance.pixels(), without.irradiance.pixels()));
}

TEST_P(EveryColourfulRenderer, FiltersChangeNothingWhereAllIsGrey) {
  const Sample grey = seen(kPatterns[3], {}, ColourFilters::none);
  const ColourTextures same = {kPatterns[3], kPatterns[3], kPatterns[3]};
  for (const ColourTextures& colours : {same, ColourTextures{}}) {
    const Sample filtered = seen(kPatterns[3], colours, ColourFilters::rggb);
    EXPECT_TRUE(std::ranges::equal(grey.irradiance.pixels(), filtered.irradiance.pixels()));
  }
}

TEST_P(EveryColourfulRenderer, ThreadsAndTilesChangeNothing) {
  const Sample whole = seen(kPatterns[3], kColours, ColourFilters::rggb);
  const Workers one(1);
  const auto alone = make(GetParam(), kPatterns[3], kColours, model_, ColourFilters::rggb, one);
  EXPECT_TRUE(std::ranges::equal(whole.irradiance.pixels(), seen(*alone).irradiance.pixels()));

  const Tile odd{37, 21, 29, 13};
  const Sample part = seen(*alone, {odd});
  for (int y = odd.y; y < odd.y + odd.height; ++y) {
    for (int x = odd.x; x < odd.x + odd.width; ++x) ASSERT_EQ(part.irradiance(x, y), whole.irradiance(x, y));
  }
}

INSTANTIATE_TEST_SUITE_P(Renderers, EveryColourfulRenderer, testing::ValuesIn(kColourful), [](const auto& test) {
  std::string name = test.param;
  std::ranges::replace(name, ' ', '_');
  return name;
});

TEST(ColourFilters, PureColoursAreSeenByTheirPixelsAlone) {
  // A plane with three columns, red, green and blue, seen frontally from in front of its centre.
  ColourTextures colours;
  for (std::size_t colour = 0; colour < 3; ++colour) {
    Image<float> image(3, 1, 0.0F);
    image(static_cast<int>(colour), 0) = 0.8F;
    colours[colour] = std::make_shared<const Texture>(image, Wrap::clamp, Wrap::clamp);
  }
  const Camera model = Camera::from_fov(91, 40, 1.0);
  const double width_m = 2 * std::tan(0.5);  // fills the view from 1 m
  TexturedPlane plane{kPatterns[3], {Eigen::Quaterniond::Identity(), {0, 0, 1}}, width_m, true, 0.2F, colours};
  const auto renderer = make_plane_renderer(plane, model, test::two_threads(), ColourFilters::rggb);
  const Sample sample = test::render(*renderer, model, Kinematics{});
  for (int y = 0; y < model.height; ++y) {
    for (const auto& [x, column] : {std::pair(15, 0), {14, 0}, {45, 1}, {46, 1}, {75, 2}, {76, 2}}) {
      // The texels' centres are at x = 14.7, 45 and 75.3; between them light is interpolated linearly.
      EXPECT_NEAR(sample.irradiance(x, y), x % 2 + y % 2 == column ? 0.8 : 0.0, 0.04) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace esim

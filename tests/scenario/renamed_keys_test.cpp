#include <gtest/gtest.h>

#include <fstream>

#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using Texts = std::vector<std::string>;

constexpr const char* kMinimal = R"(
duration_s: 1
renderer: {type: panorama, image: p.jpg}
trajectory: {type: static}
)";

constexpr const char* kSprites = R"(
renderer:
  type: sprites
  layers:
    - {image: a.png, keyframes: [{t_s: 0}, {t_s: 2, position: [5, 0]}]}
    - {image: b.png, poses: [{rotation_deg: 30}]}
)";

class RenamedKeys : public testing::Test {
 protected:
  Scenario read(const std::string& yaml, const Texts& overrides = {}) {
    std::ofstream(folder_.path() / "s.yaml") << yaml;
    return read_scenario(folder_.path() / "s.yaml", overrides);
  }
  std::string error(const std::string& yaml, const Texts& overrides = {}) {
    return test::message_of<UserError>([&] { read(yaml, overrides); });
  }

  test::TemporaryDirectory folder_;
};

TEST_F(RenamedKeys, OldKeysAreReadWithANotice) {
  const Scenario scenario = read(std::string(kMinimal) + "truth: {flow: false, displacement: true, depth: false}\n");
  EXPECT_FALSE(scenario.truth.motion_field);
  EXPECT_TRUE(scenario.truth.optical_flow);
  EXPECT_FALSE(scenario.truth.depth);
  EXPECT_EQ(scenario.notices,
            (Texts{"truth.flow is now truth.motion_field", "truth.displacement is now truth.optical_flow"}));
}

TEST_F(RenamedKeys, PresentKeysHaveNoNotice) {
  const Scenario scenario = read(std::string(kMinimal) + "truth: {motion_field: false, optical_flow: true}\n",
                                 {"truth.depth=false", "sampling={type: flow, lambda: 1}"});
  EXPECT_FALSE(scenario.truth.motion_field);
  EXPECT_EQ(scenario.notices, Texts{});
}

TEST_F(RenamedKeys, MapsAndTheirOptionsMayBothHaveOldNames) {
  const Scenario scenario = read(kSprites);
  const auto& sprites = std::get<SpritesRendererOptions>(scenario.renderer).sprites;
  ASSERT_EQ(sprites.size(), 2U);
  ASSERT_EQ(sprites[0].poses.size(), 2U);
  EXPECT_EQ(sprites[0].poses[1].position.x(), 5);
  EXPECT_EQ(sprites[1].poses[0].rotation_deg, 30);
  EXPECT_EQ(scenario.duration_s, 2);
  EXPECT_EQ(scenario.notices, (Texts{"renderer.layers is now renderer.sprites",
                                     "renderer.sprites.0.keyframes is now renderer.sprites.0.poses"}));
}

TEST_F(RenamedKeys, OverridesMayHaveOldNames) {
  for (const char* override : {"truth.flow=false", "truth={flow: false}"}) {
    const Scenario scenario = read(kMinimal, {override});
    EXPECT_FALSE(scenario.truth.motion_field) << override;
    EXPECT_EQ(scenario.notices, Texts{"truth.flow is now truth.motion_field"}) << override;
  }
  // An override replaces the option, whichever of the names each of them has.
  for (const char* before : {"flow", "motion_field"}) {
    for (const char* now : {"truth.flow=false", "truth.motion_field=false"})
      EXPECT_FALSE(read(std::string(kMinimal) + "truth: {" + before + ": true}\n", {now}).truth.motion_field);
  }
  const Scenario moved = read(kSprites, {"renderer.layers.0.keyframes.1.t_s=3", "renderer.sprites.1.image=c.png"});
  const auto& sprites = std::get<SpritesRendererOptions>(moved.renderer).sprites;
  EXPECT_EQ(sprites[0].poses[1].t_s, 3);
  EXPECT_EQ(sprites[1].image, folder_.path() / "c.png");
}

TEST_F(RenamedKeys, BothNamesAreAnError) {
  const std::string message = error(std::string(kMinimal) + "truth:\n  motion_field: true\n  flow: true\n");
  EXPECT_TRUE(contains(message, "s.yaml:7: truth.flow: must not be given together with truth.motion_field")) << message;
  EXPECT_TRUE(contains(message, "remove truth.flow")) << message;
  EXPECT_TRUE(contains(error(kMinimal, {"truth={flow: true, motion_field: true}"}), "together with"))
      << "in an override";
  EXPECT_TRUE(contains(error("renderer: {type: sprites, layers: [], sprites: []}\n"), "renderer.layers: must not be"));
}

TEST_F(RenamedKeys, ErrorsHavePresentNamesAndLines) {
  EXPECT_TRUE(
      contains(error(std::string(kMinimal) + "truth:\n  flow: 7\n"), "s.yaml:6: truth.motion_field: must be true"));
  EXPECT_TRUE(contains(error(kMinimal, {"truth.flow=7"}), "--set truth.motion_field: must be true"));
  // Maps of other kinds are left to the reader.
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "truth: 5\n"), "truth: must be a map"));
  EXPECT_TRUE(contains(error("renderer: {type: sprites, layers: 3}\n"), "renderer.sprites: must be a list"));
  EXPECT_TRUE(contains(error(std::string(kMinimal) + "flow: true\n"), "flow: unknown key")) << "in another map";
}

TEST_F(RenamedKeys, WrittenScenariosHavePresentNames) {
  const std::string text = write_scenario(read(kSprites, {"truth.displacement=false"}));
  for (const char* old : {"layers", "keyframes:", "displacement:", "flow: "})
    EXPECT_EQ(text.find(std::string(" ") + old), std::string::npos) << old;
  EXPECT_EQ(read(text).notices, Texts{});
}

}  // namespace
}  // namespace esim

#include "esim/scenario/sprite_scene.h"

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support/errors.h"
#include "support/temporary_directory.h"
#include "support/test_data.h"

namespace esim {
namespace {

using test::contains;

constexpr const char* kScene =
    "320 200 2.5\n"
    "/of/another/machine/wall.jpg 15 1.5 -5 15 0.0 0.1 0.2 -0.07 1.2 1.6 1.3 1.7\n"
    "ball.png 0 0 0 360 -1 1 0 0 0.5 0.5 0.5 0.5\n";

class SceneFile : public testing::Test {
 protected:
  SceneFile() {
    std::filesystem::create_directory(folder_.path() / "images");
    folder_.write("images/wall.jpg", "");
    folder_.write("ball.png", "");
  }
  SpriteSceneFile read(const std::string& text) {
    return read_sprite_scene(folder_.write("s.scene", text), {folder_.path() / "images"});
  }
  std::string error(const std::string& text) {
    const std::string message = test::message_of<UserError>([&] { read(text); });
    EXPECT_TRUE(contains(message, "s.scene"));
    EXPECT_EQ(message.find('\n'), std::string::npos) << "more than a line: " << message;
    return message;
  }

  test::TemporaryDirectory folder_;
};

TEST_F(SceneFile, GivesSpritesFromFrontToBack) {
  const SpriteSceneFile scene = read(kScene);
  EXPECT_EQ(scene.width, 320);
  EXPECT_EQ(scene.height, 200);
  ASSERT_EQ(scene.sprites.size(), 2U);
  const SpriteOptions &ball = scene.sprites[0], &wall = scene.sprites[1];
  EXPECT_EQ(ball.image, folder_.path() / "ball.png");
  EXPECT_EQ(ball.beyond, SpriteBeyond::nothing);
  EXPECT_EQ(wall.image, folder_.path() / "images" / "wall.jpg");
  EXPECT_EQ(wall.beyond, SpriteBeyond::mirror);
  EXPECT_EQ(wall.units, SpriteUnits::sensor);
  EXPECT_EQ(wall.median_px, 15);
  EXPECT_EQ(wall.gaussian_px, 1.5);
  ASSERT_EQ(wall.poses.size(), 2U);
  const SpritePose &start = wall.poses[0], &end = wall.poses[1];
  EXPECT_EQ(start.t_s, 0);
  EXPECT_EQ(end.t_s, 2.5);
  EXPECT_EQ(start.rotation_deg, -5);
  EXPECT_EQ(end.rotation_deg, 15);
  EXPECT_EQ(start.position, Eigen::Vector2d(0, 0.2));
  EXPECT_EQ(end.position, Eigen::Vector2d(0.1, -0.07));
  EXPECT_EQ(start.scale, Eigen::Vector2d(1.2, 1.3));
  EXPECT_EQ(end.scale, Eigen::Vector2d(1.6, 1.7));
}

TEST_F(SceneFile, LooksForImagesInThreePlacesAndNamesThem) {
  const std::string numbers = " 0 0 0 0 0 0 0 0 1 1 1 1\n";
  EXPECT_EQ(read("8 8 1\nimages/wall.jpg" + numbers).sprites[0].image, folder_.path() / "images/wall.jpg");
  EXPECT_EQ(read("8 8 1\n/x/ball.png" + numbers).sprites[0].image, folder_.path() / "ball.png");
  EXPECT_EQ(read("8 8 1\n/x/wall.jpg" + numbers).sprites[0].image, folder_.path() / "images/wall.jpg");
  const std::string message = error("8 8 1\nwall.jpg" + numbers + "/x/cat.png" + numbers);
  EXPECT_TRUE(contains(message, "s.scene:3: image cat.png is not found"));
  EXPECT_TRUE(contains(message, "/x/cat.png, " + (folder_.path() / "cat.png").string()));
  EXPECT_TRUE(contains(message, (folder_.path() / "images/cat.png").string()));
  EXPECT_TRUE(contains(message, "search_path"));
}

TEST_F(SceneFile, RefusesWhatIsCutOffOrAbsurd) {
  const std::string sprite = "ball.png 0 0 0 0 0 0 0 0 1 1 1 1\n";
  EXPECT_TRUE(contains(error(""), "s.scene:0: ends where the width should follow"));
  EXPECT_TRUE(contains(error("346 260"), "s.scene:1: ends where the duration should follow"));
  EXPECT_TRUE(contains(error("346 260 1\n"), "sprites are missing"));
  EXPECT_TRUE(contains(error("346 260 1\nball.png 0 0 0 0 0 0 0 0 1 1 1\n"), "s.scene:2: ends where a scale"));
  EXPECT_TRUE(contains(error("100000 100000 1\n" + sprite), "s.scene:1: the width is '100000'"));
  EXPECT_TRUE(contains(error("346 0 1\n" + sprite), "the height is '0'"));
  EXPECT_TRUE(contains(error("346 2.5 1\n" + sprite), "whole number"));
  EXPECT_TRUE(contains(error("346 260 -1\n" + sprite), "the duration is '-1'"));
  EXPECT_TRUE(contains(error("346 260 0\n" + sprite), "the duration is '0'"));
  EXPECT_TRUE(contains(error("346 260 nan\n" + sprite), "the duration is 'nan'"));
  EXPECT_TRUE(contains(error("346 260 1e300\n" + sprite), "the duration is '1e300'"));
  EXPECT_TRUE(contains(error("346 260 1\nball.png 0 0 0 inf 0 0 0 0 1 1 1 1\n"), "a rotation is 'inf'"));
  EXPECT_TRUE(contains(error("346 260 1\nball.png 0 0 0 0 0 0 0 0 1 1 1 1e9\n"), "a scale is '1e9'"));
  EXPECT_TRUE(contains(error("346 260 1\nball.png 0 -1 0 0 0 0 0 0 1 1 1 1\n"), "the blur is '-1'"));
  EXPECT_TRUE(contains(error("346 260 1\nball.png 1e9 0 0 0 0 0 0 0 1 1 1 1\n"), "median"));
  EXPECT_TRUE(contains(error("346 260 1\nball.png 0 0 0 ball.png 0 0 0 0 1 1 1 1\n"), "a rotation is 'ball.png'"));
  EXPECT_TRUE(contains(error(std::string("\x89PNG\0\0", 6)), "must be a .scene file"));
  EXPECT_TRUE(contains(error(std::string(2'000'000, '1')), "must be a .scene file"));
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { read_sprite_scene(folder_.path() / "no.scene", {}); }),
                       "no such file"));
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { read_sprite_scene(folder_.path(), {}); }), "no such file"));
}

TEST_F(SceneFile, StandsInAScenarioForSpritesSizeAndDuration) {
  folder_.write("s.scene", kScene);
  const std::string yaml = "renderer: {type: sprites, scene: s.scene, search_path: [images]}\n";
  const auto scenario = [&](const std::string& text, const std::vector<std::string>& overrides = {}) {
    return read_scenario(folder_.write("s.yaml", text), overrides);
  };
  const Scenario read = scenario(yaml);
  EXPECT_EQ(std::get<SpritesRendererOptions>(read.renderer).sprites.size(), 2U);
  EXPECT_EQ(read.duration_s, 2.5);
  EXPECT_EQ(read.cameras[0].width, 320);
  EXPECT_EQ(read.cameras[0].height, 200);
  EXPECT_TRUE(std::holds_alternative<StaticTrajectoryOptions>(read.trajectory));
  EXPECT_EQ(scenario(yaml, {"start_s=0.5"}).duration_s, 2.0);
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { scenario(yaml, {"start_s=3"}); }), "last pose"));
  EXPECT_EQ(scenario(yaml + "duration_s: 1\ncamera: {width: 64}\n").duration_s, 1);
  EXPECT_EQ(scenario(yaml + "camera: {width: 64}\n").cameras[0].width, 64);
  EXPECT_FALSE(scenario(yaml + "trajectory: {type: file, path: p.txt}\n").duration_s) << "ends with the trajectory";

  const std::string text = write_scenario(read);
  EXPECT_EQ(write_scenario(scenario(text)), text);
  EXPECT_EQ(text.find("s.scene"), std::string::npos) << "all sprites are explicit";
}

TEST_F(SceneFile, SpritesOfAScenarioAreReadAndChecked) {
  const auto message = [&](const std::string& renderer) {
    const auto file = folder_.write("s.yaml", "renderer: {type: sprites, " + renderer + "}\n");
    return test::message_of<UserError>([&] { read_scenario(file); });
  };
  folder_.write("s.scene", kScene);
  EXPECT_TRUE(contains(message("scene: s.scene, search_path: [images], sprites: [{image: a.png}]"), "remove one"));
  EXPECT_TRUE(contains(message("scene: s.scene"), "image wall.jpg is not found"));
  EXPECT_TRUE(contains(message("sprites: 3"), "renderer.sprites: must be a list"));
  EXPECT_TRUE(
      contains(message("sprites: [{imag: a.png}]"), "renderer.sprites.0.imag: unknown key; did you mean image?"));
  EXPECT_TRUE(contains(message("sprites: [{poses: [{}, {t_s: .nan}]}]"), "renderer.sprites.0.poses.1.t_s"));
  EXPECT_TRUE(contains(message("sprites: [{poses: [{scale: 2}]}]"), "must be a list of 2 numbers"));
  EXPECT_TRUE(contains(message("sprites: [{beyond: nothin}]"), "did you mean nothing?"));
}

TEST_F(SceneFile, TheOriginalsExampleIsRead) {
  const auto file = test::test_data("sprites/example.scene");
  const auto office = test::test_data("plane/office.jpg");
  if (!file || !office) GTEST_SKIP() << "set ESIM_TEST_DATA to run this test";
  const SpriteSceneFile scene = read_sprite_scene(*file, {office->parent_path()});
  EXPECT_EQ(scene.width, 346);
  EXPECT_EQ(scene.height, 260);
  ASSERT_EQ(scene.sprites.size(), 2U);
  EXPECT_EQ(scene.sprites[0].image.filename(), "rugby_ball.png");
  EXPECT_EQ(scene.sprites[1].image, *office);
  EXPECT_EQ(scene.sprites[0].poses[1].rotation_deg, 360);
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { read_sprite_scene(*file, {}); }), "office.jpg is not found"));
}

}  // namespace
}  // namespace esim

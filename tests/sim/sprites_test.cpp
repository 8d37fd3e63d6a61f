// Whole simulations of sprites on the sensor, from a scenario's file.
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support/errors.h"
#include "support/temporary_directory.h"
#include "support/test_data.h"

namespace esim {
namespace {

class LastFrame final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override { info = recording; }
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record)) events += part->events.size();
    if (const auto* truth = std::get_if<TruthRecord>(&record)) {
      brightest = *std::max_element(truth->irradiance.pixels().begin(), truth->irradiance.pixels().end());
      fastest = *std::max_element(truth->motion_x.pixels().begin(), truth->motion_x.pixels().end());
    }
  }
  void end(bool) override {}

  RecordingInfo info;
  std::size_t events = 0;
  float brightest = 0, fastest = 0;
};

class SpritesScenario : public testing::Test {
 protected:
  SpritesScenario() { cv::imwrite((folder_.path() / "a.png").string(), cv::Mat(8, 8, CV_8UC4, cv::Scalar::all(255))); }

  World build(const std::string& yaml) {
    return build_world(read_scenario(folder_.write("s.yaml", yaml)), 1,
                       {[&](const std::string& text) { warnings_ += text + "\n"; }, [](const std::string&) {}});
  }
  LastFrame simulate_all(World world) {
    LastFrame out;
    simulate(world, out, [](const Progress&) { return true; });
    return out;
  }
  std::string error(const std::string& yaml) {
    return test::message_of<UserError>([&] { build(yaml); });
  }

  test::TemporaryDirectory folder_;
  std::string warnings_;
};

constexpr const char* kMoving =
    "renderer: {type: sprites, sprites: [{image: a.png, poses: [{t_s: 0}, {t_s: 0.2, position: [10, 0]}]}]}\n"
    "event_camera: {contrast_threshold: 0.2}\n";

TEST_F(SpritesScenario, NeedsNoTrajectoryAndEndsWithItsPoses) {
  const LastFrame out = simulate_all(build(kMoving));
  EXPECT_EQ(out.info.end, to_ns(0.2));
  EXPECT_GT(out.events, 100U);
  EXPECT_FLOAT_EQ(out.brightest, 1.0F);
  EXPECT_FLOAT_EQ(out.fastest, 50.0F);
  EXPECT_EQ(warnings_, "");
}

TEST_F(SpritesScenario, SaysWhatHasNoEffect) {
  build(std::string(kMoving) +
        "trajectory: {type: random}\ncamera: {distortion: {type: radial-tangential, k1: -0.1}}\n");
  EXPECT_TRUE(
      test::contains(warnings_, "trajectory: has no effect on the images, since sprites are drawn on the sensor"));
  EXPECT_TRUE(test::contains(warnings_, "camera cam0: distortion has no effect"));
}

TEST_F(SpritesScenario, NamesTheInvalidSprite) {
  const auto of_sprites = [](const std::string& sprites) {
    return "duration_s: 1\nrenderer: {type: sprites, sprites: [{image: a.png}, " + sprites + "]}\n";
  };
  EXPECT_TRUE(test::contains(error("duration_s: 1\nrenderer: {type: sprites}\n"), "list sprites"));
  EXPECT_TRUE(
      test::contains(error("renderer: {type: sprites, sprites: [{image: a.png}]}\n"), "duration_s: is missing"));
  EXPECT_TRUE(test::contains(error(of_sprites("{}")), "renderer.sprites.1.image: is missing"));
  EXPECT_TRUE(test::contains(error(of_sprites("{image: b.png}")), "renderer.sprites.1: image"));
  EXPECT_TRUE(test::contains(error(of_sprites("{image: b.png}")), "no such file"));
  EXPECT_TRUE(test::contains(error(of_sprites("{image: a.png, poses: []}")), "renderer.sprites.1: has no poses"));
  EXPECT_TRUE(test::contains(error(of_sprites("{image: a.png, median_px: 4}")), "renderer.sprites.1: image"));
  EXPECT_TRUE(test::contains(error(of_sprites("{image: a.png, poses: [{t_s: 1}, {t_s: 1}]}")), "must increase"));
}

TEST_F(SpritesScenario, TheOriginalsExampleRuns) {
  const auto file = test::test_data("sprites/example.scene");
  const auto office = test::test_data("plane/office.jpg");
  if (!file || !office) GTEST_SKIP() << "set ESIM_TEST_DATA to run this test";
  const LastFrame out = simulate_all(build(
      "renderer: {type: sprites, scene: \"" + file->string() + "\", search_path: [\"" + office->parent_path().string() +
      "\"]}\nsampling: {type: uniform, rate_hz: 50}\ncamera: {width: 87, height: 65}\n"));
  EXPECT_EQ(out.info.end, to_ns(1.0));
  EXPECT_GT(out.events, 1000U);
  EXPECT_GT(out.fastest, 10.0F);
}

}  // namespace
}  // namespace esim

#include "esim/studio/editor/scenario_values.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "esim/core/error.h"

namespace esim::studio {
namespace {

const std::string kText =
    "# My room.\n"
    "renderer:\n"
    "  type: mesh        # triangles\n"
    "  scene: room/room.obj\n"
    "trajectory:\n"
    "  points:\n"
    "    - {position: [0, 0, 1], look_at: [1, 0, 1]}   # the door\n"
    "    - {position: [2, 0, 1], look_at: [1, 0, 1]}\n"
    "camera: {width: 346, height: 260, name: \"007\"}\n"
    "event_camera:\n"
    "  contrast_threshold: 0.30  # to be tuned\n";

TEST(ScenarioValues, HaveTheTypesThatWereWritten) {
  const Json values = values_of(kText, "test");
  EXPECT_EQ(values["camera"]["width"], 346);
  EXPECT_EQ(values["camera"]["name"], "007");
  EXPECT_EQ(values["event_camera"]["contrast_threshold"], 0.3);
  EXPECT_EQ(values["renderer"]["scene"], "room/room.obj");
  EXPECT_EQ(values["trajectory"]["points"][1]["position"][0], 2);
  EXPECT_EQ(values_of("a: ~\nb: true\nc: -1.5e3\nd: .inf\ne: 1e999\n", "").dump(),
            R"({"a":null,"b":true,"c":-1500.0,"d":".inf","e":"1e999"})");
}

TEST(ScenarioValues, RejectTextThatContainsItself) {
  EXPECT_THROW(values_of("a: &x\n  b: *x\n", ""), UserError);
  std::string laughs = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    laughs += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last;
    for (int k = 0; k < 9; ++k) laughs += ", " + last;
    laughs += "]\n";
  }
  EXPECT_THROW(values_of(laughs, ""), UserError);
}

// Cut anywhere, damaged anywhere: a UserError or values, never a crash.
TEST(ScenarioValues, RejectOrReadDamagedText) {
  std::mt19937 random(2);
  for (std::size_t cut = 0; cut < kText.size(); ++cut) {
    std::string damaged = kText.substr(0, cut);
    for (int i = 0; i < 3; ++i) {
      try {
        values_of(damaged, "");
      } catch (const UserError&) {
      }
      damaged = kText;
      damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
    }
  }
}

}  // namespace
}  // namespace esim::studio

#include "esim/studio/editor/scenario_values.h"

#include <gtest/gtest.h>

#include <iterator>
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

// Cut anywhere, damaged anywhere: a UserError of one line, or values. Of a cut text, all but the last are as before.
TEST(ScenarioValues, RejectOrReadDamagedText) {
  std::mt19937 random(2);
  const Json whole = values_of(kText, "");
  int refused = 0, read = 0;
  const auto values_or_null = [&](const std::string& text) -> Json {
    try {
      const Json values = values_of(text, "");
      ++read;
      return values;
    } catch (const UserError& error) {
      ++refused;
      const std::string message = error.what();
      EXPECT_TRUE(!message.empty() && message.find('\n') == std::string::npos) << message;
      return nullptr;
    }
  };
  for (std::size_t cut = 0; cut < kText.size(); ++cut) {
    const Json values = values_or_null(kText.substr(0, cut));
    if (values.is_object() && !values.empty()) {
      const auto last = std::prev(values.end()).key();
      for (const auto& [key, value] : values.items()) {
        if (key != last) {
          EXPECT_EQ(value, whole.at(key)) << cut;
        }
      }
    }
    for (int i = 0; i < 2; ++i) {
      std::string damaged = kText;
      damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
      values_or_null(damaged);
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace esim::studio

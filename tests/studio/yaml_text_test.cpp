#include "esim/studio/editor/yaml_text.h"

#include <gtest/gtest.h>

#include <random>

#include "esim/core/error.h"

namespace esim::studio {
namespace {

const char* const kText =
    "# My room.\n"
    "renderer:\n"
    "  type: mesh        # triangles\n"
    "  scene: room/room.obj\n"
    "trajectory:\n"
    "  type: waypoints\n"
    "  points:\n"
    "    - {position: [0, 0, 1], look_at: [1, 0, 1]}   # the door\n"
    "    - {position: [2, 0, 1], look_at: [1, 0, 1]}\n"
    "\n"
    "# The sensor.\n"
    "camera: {width: 346, height: 260, name: \"007\"}\n"
    "event_camera:\n"
    "  contrast_threshold: 0.30  # to be tuned\n"
    "duration_s: 1.5\n";

std::string text_with(const std::string& key, const Json& value) { return with_option(kText, key, value); }

TEST(YamlText, ValuesHaveTheTypesThatWereWritten) {
  const Json values = values_of(kText, "test");
  EXPECT_EQ(values["camera"]["width"], 346);
  EXPECT_EQ(values["camera"]["name"], "007");
  EXPECT_EQ(values["event_camera"]["contrast_threshold"], 0.3);
  EXPECT_EQ(values["renderer"]["scene"], "room/room.obj");
  EXPECT_EQ(values["trajectory"]["points"][1]["position"][0], 2);
  EXPECT_EQ(values_of("a: ~\nb: true\nc: -1.5e3\nd: .inf\ne: 1e999\n", "").dump(),
            R"({"a":null,"b":true,"c":-1500.0,"d":".inf","e":"1e999"})");
}

TEST(YamlText, AChangedNumberChangesNothingElse) {
  std::string expected = kText;
  expected.replace(expected.find("0.30"), 4, "0.25");
  EXPECT_EQ(text_with("event_camera.contrast_threshold", 0.25), expected);
}

TEST(YamlText, ValuesBetweenBracketsAreChangedInPlace) {
  std::string expected = kText;
  expected.replace(expected.find("346"), 3, "640");
  EXPECT_EQ(text_with("camera.width", 640), expected);
}

TEST(YamlText, WhatIsThereAlreadyLeavesTheTextAlone) { EXPECT_EQ(text_with("camera.width", 346), kText); }

TEST(YamlText, ANewOptionComesAtTheEndOfItsMap) {
  std::string expected = kText;
  const std::string before = "0.30  # to be tuned\n";
  expected.insert(expected.find(before) + before.size(), "  leak_rate_hz: 0.1\n");
  EXPECT_EQ(text_with("event_camera.leak_rate_hz", 0.1), expected);
}

TEST(YamlText, AMapThatIsMissingIsMade) {
  EXPECT_EQ(text_with("imu.rate_hz", 1000), std::string(kText) + "imu: {rate_hz: 1000}\n");
  EXPECT_EQ(with_option("", "seed", 7), "seed: 7\n");
}

TEST(YamlText, ARemovedOptionTakesItsLineAlong) {
  std::string expected = kText;
  expected.erase(expected.find("duration_s"));
  EXPECT_EQ(text_with("duration_s", nullptr), expected);
}

TEST(YamlText, WayPointsAreOneToALineAndTheRestStays) {
  const Json points = Json::parse(R"([{"position":[1,2,3]},{"position":[4,5,6.5],"look_at":[0,0,0]}])");
  const std::string text = text_with("trajectory.points", points);
  EXPECT_NE(text.find("  points:\n    - {position: [1, 2, 3]}\n    - {position: [4, 5, 6.5], look_at: [0, 0, 0]}\n"),
            std::string::npos)
      << text;
  for (const char* comment : {"# My room.", "# triangles", "# The sensor.", "# to be tuned"})
    EXPECT_NE(text.find(comment), std::string::npos) << text;
}

TEST(YamlText, APointIsNamedByItsNumberAndOneMoreIsNew) {
  EXPECT_EQ(values_of(text_with("trajectory.points.0.position", {7, 8, 9}), "")["trajectory"]["points"][0]["position"],
            Json({7, 8, 9}));
  const Json more = values_of(text_with("trajectory.points.2", Json{{"position", {1, 1, 1}}}), "");
  EXPECT_EQ(more["trajectory"]["points"].size(), 3U);
  EXPECT_THROW(text_with("trajectory.points.4", 1), UserError);
}

TEST(YamlText, TextThatLooksLikeSomethingElseIsQuoted) {
  for (const char* text :
       {"true", "12", "1e3", "null", "", " a", "a: b", "# no", "-x", "\"q\"", "ä", "no", "{", "a\tb"})
    EXPECT_EQ(values_of(with_option("a: 1\n", "name", text), "")["name"], text) << text;
}

TEST(YamlText, APointThatGoesTakesNothingElseAlong) {
  const std::string text = text_with("trajectory.points.0", nullptr);
  EXPECT_EQ(values_of(text, "")["trajectory"]["points"].size(), 1U);
  for (const char* comment : {"# My room.", "# triangles", "# The sensor.", "# to be tuned"})
    EXPECT_NE(text.find(comment), std::string::npos) << text;
}

// Whatever is changed, by whichever way, the text then says exactly that.
TEST(YamlText, AnyChangeMeansWhatWasAsked) {
  const std::vector<std::string> keys = {
      "renderer",        "renderer.type",         "renderer.scene", "trajectory.points",
      "trajectory.type", "trajectory.points.1",   "camera",         "camera.name",
      "camera.height",   "event_camera",          "duration_s",     "seed",
      "imu.rate_hz",     "trajectory.points.0.t", "output.formats", "camera.distortion.type"};
  const std::vector<Json> values = {nullptr,
                                    1,
                                    -0.5,
                                    "some text",
                                    true,
                                    Json::parse("[1, 2, 3]"),
                                    Json::parse(R"({"a": {"b": [1, "x"]}, "c": false})"),
                                    Json::parse(R"([{"a": 1}, {"b": [2]}])"),
                                    Json::object(),
                                    Json::array()};
  std::mt19937 random(1);
  for (int run = 0; run < 300; ++run) {
    std::string text = kText;
    for (int change = 0; change < 4; ++change) {
      const std::string& key = keys[random() % keys.size()];
      const Json& value = values[random() % values.size()];
      std::string changed;
      try {
        changed = with_option(text, key, value);
      } catch (const UserError&) {  // no such entry of a list
        continue;
      }
      // Other options are as before.
      Json before = values_of(text, ""), after = values_of(changed, "");
      const std::string top = key.substr(0, key.find('.'));
      before.erase(top), after.erase(top);
      ASSERT_EQ(nlohmann::json(before), nlohmann::json(after)) << key << " = " << value << " in\n"
                                                               << text << "gives\n"
                                                               << changed;
      // And so is the option itself what was asked.
      if (!value.is_null()) {
        ASSERT_EQ(with_option(changed, key, value), changed) << key << " = " << value << "\n" << changed;
      }
      text = changed;
    }
  }
}

TEST(YamlText, WhatHoldsItselfIsRefused) {
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

// Cut anywhere, damaged anywhere: a UserError or a text that means something, never a crash.
TEST(YamlText, DamagedTextIsRefusedOrRead) {
  const std::string text = kText;
  std::mt19937 random(2);
  for (std::size_t cut = 0; cut < text.size(); ++cut) {
    std::string damaged = text.substr(0, cut);
    for (int i = 0; i < 3; ++i) {
      try {
        values_of(with_option(damaged, "camera.width", 5), "");
      } catch (const UserError&) {
      }
      damaged = text;
      damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
    }
  }
}

}  // namespace
}  // namespace esim::studio

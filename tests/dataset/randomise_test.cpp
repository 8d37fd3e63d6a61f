#include "esim/dataset/generators/randomise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "esim/core/error.h"
#include "esim/dataset/cluster.h"
#include "esim/dataset/generators/scenario_sequences.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

TEST(Randomise, ReadsDistributions) {
  const ScenarioTemplate read = read_template(
      "seed: 1\nrandomise:\n  a.b: {uniform: [0.1, 0.5]}\n  c: {choice: [x.png, [1, 2]]}\n  d: {integer: [-1, 3]}\n"
      "  e: {log_uniform: [1, 100]}\n  f: {normal: [5, 2]}\n",
      "t.yaml");
  EXPECT_EQ(read.yaml, "seed: 1");
  ASSERT_EQ(read.options.size(), 5U);
  EXPECT_EQ(read.options[0].key, "a.b");
  EXPECT_EQ(std::get<Uniform>(read.options[0].distribution).high, 0.5);
  EXPECT_EQ(std::get<Choice>(read.options[1].distribution).values, (std::vector<std::string>{"x.png", "[1, 2]"}));
  EXPECT_EQ(std::get<WholeNumber>(read.options[2].distribution).low, -1);
  EXPECT_TRUE(read_template("seed: 1", "t.yaml").options.empty());
}

TEST(Randomise, SaysWhatIsWrongAndWhere) {
  const auto problem = [](const std::string& distribution) {
    return test::message_of<UserError>([&] { read_template("randomise:\n  a.b: " + distribution, "t.yaml"); });
  };
  EXPECT_TRUE(test::contains(problem("{uniform: [2, 1]}"), "t.yaml:2: randomise.a.b: LOW is 2"));
  EXPECT_TRUE(test::contains(problem("{uniform: [1]}"), "two numbers, [LOW, HIGH]"));
  EXPECT_TRUE(test::contains(problem("{uniform: [a, b]}"), "two numbers"));
  EXPECT_TRUE(test::contains(problem("{uniform: [0, .inf]}"), "two numbers"));
  EXPECT_TRUE(test::contains(problem("{log_uniform: [0, 1]}"), "LOW is 0"));
  EXPECT_TRUE(test::contains(problem("{normal: [0, -1]}"), "DEVIATION is -1"));
  EXPECT_TRUE(test::contains(problem("{integer: [0.5, 1]}"), "two numbers"));
  EXPECT_TRUE(test::contains(problem("{choice: []}"), "at least one"));
  EXPECT_TRUE(test::contains(problem("{gaussian: [0, 1]}"), "unknown distribution 'gaussian'; use uniform"));
  EXPECT_TRUE(test::contains(problem("0.5"), "must be a map with one key of uniform"));
  EXPECT_TRUE(test::contains(problem("{uniform: [0, 1], normal: [0, 1]}"), "one key of"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([] { read_template("a: [", "t.yaml"); }), "t.yaml:"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([] { read_template("randomise: 3", "t.yaml"); }), "a map"));
}

TEST(Randomise, DrawsWhatTheDistributionSays) {
  constexpr std::uint32_t kDraws = 4000;
  const auto mean = [](const Distribution& distribution, auto value) {
    double sum = 0;
    for (std::uint32_t i = 0; i < kDraws; ++i) sum += value(std::stod(draw(distribution, 1, i, 0)));
    return sum / kDraws;
  };
  const auto itself = [](double x) { return x; };
  EXPECT_NEAR(mean(Uniform{2, 4}, itself), 3, 4 * 0.577 / std::sqrt(kDraws));
  EXPECT_NEAR(mean(LogUniform{0.01, 100}, [](double x) { return std::log10(x); }), 0, 4 * 1.155 / std::sqrt(kDraws));
  EXPECT_NEAR(mean(Normal{5, 2}, itself), 5, 4 * 2 / std::sqrt(kDraws));
  EXPECT_NEAR(mean(Normal{5, 2}, [](double x) { return (x - 5) * (x - 5); }), 4, 4 * 4 * 1.42 / std::sqrt(kDraws));
  std::map<std::string, int> counts;
  for (std::uint32_t i = 0; i < kDraws; ++i) ++counts[draw(WholeNumber{-1, 2}, 1, i, 0)];
  ASSERT_EQ(counts.size(), 4U);
  for (const auto& [value, count] : counts) EXPECT_NEAR(count, kDraws / 4, 4 * std::sqrt(kDraws * 3 / 16)) << value;
  EXPECT_EQ(draw(Choice{{"a"}}, 1, 3, 0), "a");
  EXPECT_NE(draw(Uniform{0, 1}, 1, 3, 0), draw(Uniform{0, 1}, 1, 3, 1)) << "options are independent";
}

class ScenarioTemplates : public testing::Test {
 protected:
  ScenarioTemplates() {
    folder_.write("wall.ppm", [] {
      std::string text = "P5 64 48 255\n";
      for (int i = 0; i < 64 * 48; ++i) text += static_cast<char>(i * 37 % 251);
      return text;
    }());
  }
  std::filesystem::path write(const std::string& randomise) {
    return folder_.write("t.yaml",
                         "renderer: {type: plane, image: wall.ppm, width_m: 1, endless: true,\n"
                         "           pose: {position: [1, 0, 0], look_at: [2, 0, 0]}}\n"
                         "trajectory: {type: random, position_amplitude_m: [0.2, 0.2, 0.2]}\nduration_s: 0.1\n"
                         "sampling: {type: flow}\n" +
                             randomise);
  }
  test::TemporaryDirectory folder_;
};

TEST_F(ScenarioTemplates, MakeSequencesWithWhatWasDrawn) {
  const auto file = write(
      "camera: {width: 32, height: 24}\nrandomise:\n  camera.width: {integer: [30, 40]}\n  "
      "event_camera.contrast_threshold: {uniform: [0.1, 0.2]}\n");
  const ScenarioSequences sequences(file, {}, 1, true), again(file, {}, 1, true);
  std::set<int> widths;
  for (std::uint32_t i = 0; i < 6; ++i) {
    const Sequence sequence = sequences.make(i);
    widths.insert(sequence.width);
    EXPECT_EQ(sequence.events, again.make(i).events);
    EXPECT_EQ(sequence.optical_flow.x.width(), sequence.width);
    EXPECT_EQ(sequence.depth.width(), sequence.width);
    EXPECT_EQ(sequence.span.end - sequence.span.start, 100'000'000);
  }
  EXPECT_GT(widths.size(), 2U);
  EXPECT_NE(sequences.make(0).events, ScenarioSequences(file, {}, 2, true).make(0).events);
}

TEST_F(ScenarioTemplates, AreRenderedOnceForSeveralSensors) {
  const auto file =
      write("randomise: {event_camera.contrast_threshold: {uniform: [0.1, 0.5]}, camera.width: {integer: [20, 60]}}\n");
  const ScenarioSequences sequences(file, {}, 1, true, 3);
  ASSERT_EQ(sequences.sensors(), 3U);
  std::set<double> thresholds;
  for (std::uint32_t rendering = 0; rendering < 3; ++rendering) {
    const std::vector<Sequence> all = sequences.make_all(rendering);
    ASSERT_EQ(all.size(), 3U);
    for (std::uint32_t k = 0; k < 3; ++k) {
      EXPECT_EQ(all[k].index, 3 * rendering + k);
      EXPECT_EQ(all[k].width, all[0].width);
      EXPECT_TRUE(std::ranges::equal(all[k].optical_flow.x.pixels(), all[0].optical_flow.x.pixels()));
      EXPECT_GT(all[k].events.size(), 10U);
      EXPECT_EQ(all[k].events, sequences.make(3 * rendering + k).events);
      const auto info = nlohmann::json::parse(all[k].info);
      thresholds.insert(std::stod(info.at("event_camera.contrast_threshold").get<std::string>()));
      EXPECT_EQ(info.at("sensor"), "sensor" + std::to_string(k));
    }
  }
  EXPECT_EQ(thresholds.size(), 9U) << "each sensor has its own";
  EXPECT_NE(sequences.options(), ScenarioSequences(file, {}, 1, true, 4).options());
  // The same from a scenario with several sensors of its own.
  const ScenarioSequences own(write("event_cameras: [{contrast_threshold: 0.2}, {contrast_threshold: 0.4}]\n"), {}, 1,
                              true);
  ASSERT_EQ(own.sensors(), 2U);
  EXPECT_GT(own.make(0).events.size(), own.make(1).events.size());
}

TEST_F(ScenarioTemplates, NameUnknownOptionsAndValuesOutOfRange) {
  const auto problem = [&](const std::string& randomise, std::vector<std::string> set = {}) {
    return test::message_of<UserError>([&] { ScenarioSequences(write(randomise), set, 1, true); });
  };
  EXPECT_TRUE(test::contains(problem("randomise: {camera.widht: {integer: [1, 2]}}"), "camera.widht"));
  EXPECT_TRUE(test::contains(problem("randomise: {camera.width: {integer: [0, 20]}}"), "camera.width"));
  EXPECT_TRUE(test::contains(problem("randomise: {event_camera.contrast_threshold: {uniform: [0.1, 1000]}}"),
                             "event_camera.contrast_threshold"));
  EXPECT_TRUE(test::contains(problem("", {"camera.widht=3"}), "--set camera.widht"));
  EXPECT_TRUE(test::contains(problem("cameras: [{}, {}]\n"), "camera"));
}

TEST(Cluster, SharesAreThoseOfTheTask) {
  for (const char* name :
       {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT", "JOB_COMPLETION_INDEX"})
    ::unsetenv(name);
  EXPECT_EQ(share_named("").parts, 1U);
  EXPECT_EQ(share_named("3/8").part, 3U);
  for (const char* wrong : {"8/8", "a/8", "3", "3/", "/8", "-1/8", "3/0", "auto/4"})
    EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { share_named(wrong); }), wrong));
  ::setenv("JOB_COMPLETION_INDEX", "5", 1);
  EXPECT_EQ(share_named("auto/8").part, 5U);
  EXPECT_EQ(share_named("").parts, 1U);
  ::setenv("SLURM_ARRAY_TASK_ID", "12", 1);
  ::setenv("SLURM_ARRAY_TASK_MIN", "10", 1);
  ::setenv("SLURM_ARRAY_TASK_COUNT", "4", 1);
  EXPECT_EQ(share_named("").part, 2U);
  EXPECT_EQ(share_named("").parts, 4U);
  for (const char* name :
       {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT", "JOB_COMPLETION_INDEX"})
    ::unsetenv(name);
}

TEST(Cluster, ScriptsQuoteWhatShellsWouldTakeApart) {
  const std::string script = slurm_script({3, "/data/set", "/home/me", {"esim", "a b", "it's"}, {"--time=5"}});
  EXPECT_TRUE(test::contains(script, "#SBATCH --array=0-2\n"));
  EXPECT_TRUE(test::contains(script, "#SBATCH --time=5\n"));
  EXPECT_TRUE(test::contains(script, "exec 'esim' 'a b' 'it'\\''s' --shard auto/3\n"));
}

}  // namespace
}  // namespace esim

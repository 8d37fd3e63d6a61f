#include "esim/evaluate/sampling_evaluation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "esim/evaluate/paper_scenario.h"
#include "esim/evaluate/schemes.h"
#include "esim/scenario/sampling_text.h"
#include "sim/card_scene.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::TemporaryDirectory;

const Notices kSilent{[](const std::string&) {}, [](const std::string&) {}};

/// A panorama of smooth waves.
std::string panorama_pgm() {
  constexpr int kWidth = 512, kHeight = 256;
  std::string text = "P5 512 256 255\n";
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      text += static_cast<char>(static_cast<int>(128 + 60 * std::sin(x * 0.2) + 50 * std::cos(y * 0.17 + x * 0.05)));
  }
  return text;
}

Scenario small_paper_scenario(const TemporaryDirectory& folder) {
  Scenario scenario =
      paper_scenario(folder.write("panorama.pgm", panorama_pgm()), folder.write("rotation.txt", paper_rotation()));
  scenario.cameras[0].width = 48, scenario.cameras[0].height = 36;
  scenario.start_s = 1;
  scenario.duration_s = 0.2;
  return scenario;
}

SamplingEvaluationOptions small_options() {
  SamplingEvaluationOptions options;
  options.pixels = 30;
  options.truth_rate_hz = 4000;
  options.event_rate_hz = 4000;
  options.event_span_s = 0.04;
  options.window_s = 0.08;
  options.threads = 1;
  return options;
}

SamplingEvaluation evaluate(const Scenario& scenario, const SamplingEvaluationOptions& options) {
  const EvaluationMonitor monitor{[](double, const std::string&) { return true; }, [](const SamplingEvaluation&) {}};
  return evaluate_sampling(scenario, options, kSilent, monitor).value();
}

TEST(SamplingEvaluation, FindsNoErrorInTheReferenceItself) {
  const TemporaryDirectory folder;
  SamplingEvaluationOptions options = small_options();
  options.schemes = {UniformSampling{4000}, UniformSampling{250}};
  const SamplingEvaluation found = evaluate(small_paper_scenario(folder), options);
  ASSERT_EQ(found.schemes.size(), 2U);
  ASSERT_EQ(found.windows.size(), 3U);
  for (std::size_t w = 0; w < 3; ++w) {
    const WindowResult &exact = found.schemes[0].windows[w], &coarse = found.schemes[1].windows[w];
    EXPECT_LT(exact.brightness.max_abs, 1e-6);
    EXPECT_GT(coarse.brightness.mean_rmse, 1e-4);
    EXPECT_NEAR(exact.samples_per_s, 4000, 15);
    EXPECT_NEAR(exact.frame_equivalents_per_s, exact.samples_per_s, 1e-6);
    ASSERT_TRUE(exact.events);
    EXPECT_GT(exact.events->reference, 0);
    EXPECT_EQ(exact.events->matched, exact.events->reference);
    EXPECT_EQ(exact.events->identical_pixels, exact.events->active_pixels);
    EXPECT_EQ(exact.events->quantiles_s.back(), 0);
    EXPECT_GT(coarse.events->p95_s, 0);
  }
  EXPECT_EQ(found.goals.size(), 1U);
}

TEST(SamplingEvaluation, AcceptsEverySamplingMethod) {
  const TemporaryDirectory folder;
  SamplingEvaluationOptions options = small_options();
  options.event_span_s = 0;
  for (const std::string& type : sampling_types()) options.schemes.push_back(read_sampling(type));
  const SamplingEvaluation found = evaluate(small_paper_scenario(folder), options);
  ASSERT_EQ(found.schemes.size(), sampling_types().size());
  for (const SchemeResult& scheme : found.schemes) {
    const WindowResult& all = scheme.windows.back();
    EXPECT_GT(all.frame_equivalents_per_s, 0) << scheme.text;
    EXPECT_LT(all.brightness.mean_rmse, 0.1) << scheme.text;
    EXPECT_EQ(all.brightness.values, 30 * 800) << scheme.text << " misses pixels or times";
    EXPECT_FALSE(all.events);
  }
}

/// A card that crosses the view in front of a wall, each of uniform grey.
class PlacesOfErrors : public test::CardScene {
 protected:
  PlacesOfErrors() {
    mesh().samples_per_pixel = 16;
    scenario_.duration_s = 0.1;
    options_ = small_options();
    options_.pixels = 0;
    options_.truth_rate_hz = 500;
    options_.event_span_s = 0;
  }

  /// The errors in the window "all".
  BrightnessError errors_of(const SamplingOptions& scheme) {
    options_.schemes = {scheme};
    return evaluate(scenario_, options_).schemes[0].windows.back().brightness;
  }
  static double squares_at(const BrightnessError& error, Place place) {
    return error.places[static_cast<std::size_t>(place)].squares;
  }

  SamplingEvaluationOptions options_;
};

TEST_F(PlacesOfErrors, AddUp) {
  const BrightnessError error = errors_of(UniformSampling{100});
  double squares = 0, of_pixels = 0;
  std::int64_t values = 0;
  for (const PlaceError& place : error.places) squares += place.squares, values += place.values;
  for (const double rmse : error.rmse) of_pixels += rmse * rmse;
  EXPECT_EQ(values, error.values);
  EXPECT_NEAR(squares, of_pixels * static_cast<double>(error.values) / static_cast<double>(error.rmse.size()),
              1e-6 * squares);
  EXPECT_EQ(squares_at(error, Place::crease), 0);
  EXPECT_GT(squares_at(error, Place::depth_edge), 0) << "at the card's edge";
  EXPECT_GT(squares_at(error, Place::surface), 0) << "where the edge was or will be at the next sample";
}

TEST_F(PlacesOfErrors, AreOnEdgesWhereTheTruthAloneHasMoreRays) {
  mesh().engine = MeshEngine::raycast;
  EXPECT_LT(errors_of(UniformSampling{500}).max_abs, 1e-6);
  options_.truth_rays = 64;
  const BrightnessError error = errors_of(UniformSampling{500});
  const double on_edges = squares_at(error, Place::depth_edge) + squares_at(error, Place::near_edge);
  EXPECT_GT(on_edges, 0);
  EXPECT_LT(squares_at(error, Place::surface), 0.2 * on_edges)
      << "only from the card as it enters at the image's border";
  EXPECT_LT(error.max_abs, 0.25) << "16 rays compared with 64 at an edge";
}

TEST(SamplingEvaluation, KnowsNoPlacesOfSomePixels) {
  const TemporaryDirectory folder;
  SamplingEvaluationOptions options = small_options();
  options.event_span_s = 0;
  options.schemes = {UniformSampling{250}};
  const SamplingEvaluation found = evaluate(small_paper_scenario(folder), options);
  for (const PlaceError& place : found.schemes[0].windows[0].brightness.places) EXPECT_EQ(place.values, 0);
  options.truth_rays = 64;
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { evaluate(small_paper_scenario(folder), options); }),
                             "casts no rays"));
}

TEST(SamplingEvaluation, StopsWhereTheMonitorSaysSo) {
  const TemporaryDirectory folder;
  SamplingEvaluationOptions options = small_options();
  options.schemes = quick_schemes();
  int calls = 0;
  const EvaluationMonitor monitor{[&](double, const std::string&) { return ++calls < 20; },
                                  [](const SamplingEvaluation&) {}};
  EXPECT_FALSE(evaluate_sampling(small_paper_scenario(folder), options, kSilent, monitor));
}

TEST(PaperScenario, MovesAsThePaperSays) {
  const TemporaryDirectory folder;
  const Scenario scenario =
      paper_scenario(folder.write("panorama.pgm", panorama_pgm()), folder.write("rotation.txt", paper_rotation()));
  const World world = build_world(scenario, 1, kSilent);
  const TimeSpan all{world.info.start, world.info.end};
  const MotionCurve motion = measure_motion(world, spread_pixels(346, 260, 400), 200);
  const std::vector<Window> windows = choose_windows(motion, all, 1);
  EXPECT_NEAR(to_seconds(all.end - all.start), 5, 1e-9);
  EXPECT_NEAR(windows[0].mean_px_per_s, 330, 0.05 * 330);
  EXPECT_NEAR(windows[1].mean_px_per_s, 1075, 0.05 * 1075);
  EXPECT_NEAR(windows[2].mean_px_per_s, 580, 0.05 * 580);
  EXPECT_NEAR(motion.fastest_turn_deg_per_s, 1000, 50);
  EXPECT_NEAR(motion.max_px_per_s, 4500, 0.08 * 4500);
  EXPECT_EQ(std::get<PanoramaRendererOptions>(scenario.renderer).median_px, 5) << "as the original's configuration";
}

SchemeResult scheme(const std::string& family, double frames, double samples, double rmse) {
  SchemeResult result;
  result.family = family;
  result.windows.resize(1);
  result.windows[0].frame_equivalents_per_s = frames;
  result.windows[0].samples_per_s = samples;
  result.windows[0].brightness.mean_rmse = rmse;
  return result;
}

TEST(Goals, AreInterpolatedInLogarithms) {
  const std::vector<GoalCost> goals = interpolate_goals(
      {scheme("a", 4000, 400, 0.001), scheme("a", 1000, 100, 0.016), scheme("b", 1000, 1000, 0.5)}, 0.004);
  ASSERT_EQ(goals.size(), 2U);
  EXPECT_NEAR(goals[0].frame_equivalents_per_s.value(), 2000, 1e-6);
  EXPECT_NEAR(goals[0].samples_per_s.value(), 200, 1e-6);
  EXPECT_FALSE(goals[1].samples_per_s);
}

}  // namespace
}  // namespace esim

// The figures of an evaluation: drawn for any result, with data in their diagrams.
#include "esim/evaluate/report/figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace esim {
namespace {

/// Each scheme has the error `rmse` at all pixels, divided by its number; the second of each family costs twice the
/// first.
SamplingEvaluation evaluation(double rmse, int families, bool with_events) {
  SamplingEvaluation result;
  result.span = {0, 4'000'000'000};
  result.motion = {0, 10, std::vector<double>(41, 300.0), 300, 10};
  result.windows = {
      {"slow", {0, 1'000'000'000}, 200}, {"fast", {2'000'000'000, 3'000'000'000}, 900}, {"all", result.span, 300}};
  if (with_events) {
    for (const Window& window : result.windows)
      result.event_spans.push_back({window.span.start, window.span.start + 50});
  }
  for (int family = 0; family < families; ++family) {
    const std::string name = "family" + std::to_string(family);
    for (const double factor : {1.0, 2.0}) {
      SchemeResult scheme;
      scheme.family = name;
      scheme.text = name + " with a text that is not short, factor=" + std::to_string(factor);
      for (std::size_t w = 0; w < result.windows.size(); ++w) {
        WindowResult window;
        window.frame_equivalents_per_s = 100 * factor * (family + 1);
        window.brightness.mean_rmse = rmse / factor;
        window.brightness.rmse.assign(30, rmse / factor);
        if (with_events) window.events.emplace().quantiles_s.assign(101, 1e-4 * factor * (family + 1.2));
        scheme.windows.push_back(std::move(window));
      }
      result.schemes.push_back(std::move(scheme));
    }
    result.goals.push_back({name, {}, {}});
  }
  return result;
}

/// The number of pixels of a colour in the part of an image that is left of `right` and above `bottom`.
int pixels_of(const Image<Rgb>& image, Rgb colour, int right, int bottom) {
  int count = 0;
  for (int y = 0; y < std::min(bottom, image.height()); ++y)
    count += static_cast<int>(std::count(image.row(y), image.row(y) + std::min(right, image.width()), colour));
  return count;
}

TEST(EvaluationFigures, ShowTheirData) {
  const SamplingEvaluation result = evaluation(0.02, 2, true);
  constexpr Rgb kFirst{222, 120, 24}, kSecond{52, 142, 84}, kSlow{212, 60, 60};
  constexpr int kAll = 10000, kLegendBar = 12 * 12, kDiagram = 690, kLegendTop = 464;
  EXPECT_GT(pixels_of(draw_error_boxes(result), kSlow, kAll, kAll), kLegendBar + 20) << "medians";
  for (const Rgb colour : {kFirst, kSecond}) {  // without the legends
    EXPECT_GT(pixels_of(draw_error_over_cost(result), colour, kAll, kLegendTop), 100) << "three diagrams with two dots";
    EXPECT_GT(pixels_of(draw_timing(result), colour, kDiagram, kAll), 300) << "a vertical line";
  }
  EXPECT_GT(pixels_of(draw_motion(result), {30, 30, 30}, kAll, kAll), 800) << "a horizontal line";
}

TEST(EvaluationFigures, TheLegendOfTheTimingsFits) {
  const Image<Rgb> image = draw_timing(evaluation(0.02, 3, true));
  for (int x : {image.width() - 1, image.width() - 6}) {
    for (int y = 0; y < image.height(); ++y) ASSERT_EQ(image(x, y), (Rgb{255, 255, 255})) << x << " " << y;
  }
}

TEST(EvaluationFigures, AreDrawnForAnyResult) {
  for (const double rmse : {0.0, 1e-12, 0.02, 50.0}) {
    for (const int families : {0, 1, 12}) {
      for (const bool with_events : {false, true}) {
        const SamplingEvaluation result = evaluation(rmse, families, with_events);
        EXPECT_FALSE(draw_motion(result).empty());
        EXPECT_FALSE(draw_error_boxes(result).empty());
        EXPECT_FALSE(draw_error_over_cost(result).empty());
        EXPECT_EQ(draw_timing(result).empty(), !with_events);
      }
    }
  }
  SamplingEvaluation still = evaluation(0.02, 1, true);
  still.span = {0, 0};
  still.motion.mean_px_per_s = {0};
  EXPECT_FALSE(draw_motion(still).empty());
}

}  // namespace
}  // namespace esim

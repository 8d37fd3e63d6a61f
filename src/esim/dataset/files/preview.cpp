#include "esim/dataset/files/preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "esim/plot/axes.h"
#include "esim/visualise/page.h"

namespace esim::inline dataset {
namespace {

constexpr Rgb kTargetColour{222, 120, 24};

/// Events over the dimmed image, as in previews of recordings.
Image<Rgb> draw_events(const Sequence& sequence) {
  Image<float> on(sequence.width, sequence.height), off(sequence.width, sequence.height);
  for (const Event& event : sequence.events) ++(event.polarity > 0 ? on : off)(event.x, event.y);
  return render_events(on, off, sequence.first);
}

Image<Rgb> draw_motion_field(const Sequence& sequence) {
  if (sequence.motion_field.empty()) return Image<Rgb>(sequence.width, sequence.height, kNoDepthColour);
  float fastest = 1e-3F;
  for (std::size_t i = 0; i < sequence.motion_field.x.size(); ++i)
    fastest = std::max(fastest, std::hypot(sequence.motion_field.x.data()[i], sequence.motion_field.y.data()[i]));
  return colour_motion(sequence.motion_field.x, sequence.motion_field.y, fastest);
}

double mean_magnitude(const VectorField& field) {
  if (field.empty()) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < field.x.size(); ++i) {
    const double magnitude = std::hypot(field.x.data()[i], field.y.data()[i]);
    if (std::isfinite(magnitude)) sum += magnitude;
  }
  return sum / static_cast<double>(field.x.size());
}

/// The histogram's outline: fractions per doubling over the magnitude.
std::vector<DataPoint> outline(const MagnitudeHistogram& bins, const std::vector<double>& fractions, double min) {
  std::vector<DataPoint> points;
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    const double low = std::max(bins.edges[i], min), high = bins.edges[i + 1];
    if (high <= low) continue;
    const double density = fractions[i] / std::log2(high / low);
    points.push_back({low, 100 * density});
    points.push_back({high, 100 * density});
  }
  return points;
}

}  // namespace

Image<Rgb> draw_sequences(std::span<const Sequence> sequences) {
  constexpr int kPanels = 3, kGap_px = 4, kColumns = 2;
  std::vector<CaptionedPicture> pictures;
  for (const Sequence& sequence : sequences) {
    const int width = sequence.width, height = sequence.height;
    Canvas canvas(kPanels * width + (kPanels - 1) * kGap_px, height, kDarkTheme.page);
    canvas.draw(grey(sequence.first), 0, 0);
    canvas.draw(draw_events(sequence), width + kGap_px, 0);
    canvas.draw(draw_motion_field(sequence), 2 * (width + kGap_px), 0);
    pictures.push_back(
        {std::move(canvas).take(), fmt::format("{}:  {} events,  mean optical flow {:.3g} px", sequence.index,
                                               sequence.events.size(), mean_magnitude(sequence.optical_flow))});
  }
  return draw_contact_sheet(pictures, kColumns, kDarkTheme);
}

std::vector<double> fractions_of(std::span<const std::uint64_t> counts) {
  const double sum = static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
  std::vector<double> fractions;
  for (const std::uint64_t count : counts.first(counts.size() - 1))
    fractions.push_back(sum > 0 ? static_cast<double>(count) / sum : 0.0);
  return fractions;
}

Image<Rgb> draw_magnitudes(const MagnitudeHistogram& bins, bool is_target, std::span<const std::uint64_t> counts) {
  constexpr int kWidth = 900, kHeight = 480;
  const double max = bins.edges.back(), min = max / 4096;
  const std::vector<DataPoint> made = outline(bins, fractions_of(counts), min);
  const std::vector<DataPoint> target = is_target ? outline(bins, bins.fractions, min) : std::vector<DataPoint>{};
  double top = 1;
  for (const auto* points : {&made, &target}) {
    for (const DataPoint& point : *points) top = std::max(top, 1.15 * point.y);
  }
  const Rgb made_colour = mix(kBarColour, kLightTheme.page, 0.5F);
  AxesOptions options{"Optical flow of the pixels over a sequence", {{"this dataset", made_colour}}};
  if (is_target) options.legend.push_back({bins.source, kTargetColour, Mark::line});
  Canvas canvas(kWidth, kHeight, kLightTheme.page);
  Axes axes(canvas, canvas.pixels().bounds(), logarithmic_scale(min, max, "magnitude (px)"),
            linear_scale(0, top, "pixels per doubling (%)"), std::move(options));
  for (std::size_t i = 0; i + 1 < made.size(); i += 2) axes.fill(made[i].x, made[i + 1].x, 0, made[i].y, made_colour);
  axes.line(target, kTargetColour, 3);
  axes.finish();
  return std::move(canvas).take();
}

}  // namespace esim::inline dataset

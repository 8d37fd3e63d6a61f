#include "esim/fit/contrast_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "esim/core/error.h"
#include "esim/fit/jackknife.h"
#include "esim/fit/pixel_thresholds.h"
#include "esim/stats/numerics/median.h"

namespace esim::inline fit {
namespace {

constexpr float kNoBrightness = std::numeric_limits<float>::quiet_NaN();
constexpr TimeNs kImagesPerEvent = 2;
constexpr double kShort = 3;                // refractory periods: events nearer to each other miss too much
constexpr double kTypicalThreshold = 0.25;  // ln
constexpr std::uint32_t kManyEvents = 20;   // of the neighbours of a pixel that is dead without events
const char* const kMovingScene = "events and images of a moving scene";

}  // namespace

ContrastFit::ContrastFit(int width, int height, const Options& options) : options_(options), pixels_(width, height) {}

void ContrastFit::add(TimeNs t, const Image<float>& intensity, EventSpan events) {
  if (intensity.width() != pixels_.width() || intensity.height() != pixels_.height()) {
    throw UserError(fmt::format("the image at {:.6f} s has {} x {} px, but the sensor {} x {} px", to_seconds(t),
                                intensity.width(), intensity.height(), pixels_.width(), pixels_.height()));
  }
  if (!images_.empty() && t <= images_.back().t)
    throw UserError(fmt::format("the image at {:.9f} s is not later than the previous one", to_seconds(t)));
  for (const Event& event : events) add_event(event);
  KeptImage image{t, {}};
  if (images_.size() == kKeptImages) {
    image.logs = std::move(images_.front().logs);
    images_.pop_front();
  }
  image.logs.resize(pixels_.size());
  const auto offset = static_cast<float>(options_.offset);
  std::transform(intensity.pixels().begin(), intensity.pixels().end(), image.logs.begin(), [offset](float value) {
    return value > 0 && std::isfinite(value) ? std::log(value + offset) : kNoBrightness;
  });
  images_.push_back(std::move(image));
  for (const Event& event : events) look_at_images(event);
}

void ContrastFit::add_event(const Event& event) {
  Pixel& pixel = pixels_(event.x, event.y);
  ++pixel.events;
  const double between_s = to_seconds(event.t - pixel.last);
  const bool alike = pixel.polarity == event.polarity;
  if (pixel.polarity == 0 || (alike && between_s < kShort * options_.refractory_s)) {
    close(pixel);
    pixel.chain = {};
    pixel.since = event.t;
    pixel.between = 0;
  } else {
    // Without images, what the pixel misses while its brightness turns is unknown: little, and of either sign.
    double way = alike ? between_s / (between_s - options_.refractory_s) : 1;
    if (pixel.images_apart > 0 &&
        kImagesPerEvent * pixel.images_apart < std::min(event.t - pixel.last, pixel.between)) {
      const auto slope = static_cast<double>(pixel.slope);
      add_equation(pixel, pixel.chain, pixel.last, slope, static_cast<double>(pixel.brightness));
      pixel.chain.missed += options_.refractory_s * slope;
      way = 1;
    } else if (alike) {
      compare_at_image(pixel, event, way);
    }
    pixel.chain = pixel.chain.plus(event.polarity, way);
    pixel.between = event.t - pixel.last;
  }
  pixel.last = event.t;
  pixel.polarity = event.polarity;
  pixel.images_apart = 0;
}

/// Takes the brightness at an event from the last two images, which are around it.
void ContrastFit::look_at_images(const Event& event) {
  Pixel& pixel = pixels_(event.x, event.y);
  if (pixel.last != event.t || images_.size() < 2) return;  // a later event of the pixel matters
  const KeptImage &before = images_[images_.size() - 2], &after = images_.back();
  const std::size_t i = static_cast<std::size_t>(event.y) * static_cast<std::size_t>(pixels_.width()) + event.x;
  const auto l0 = static_cast<double>(before.logs[i]), l1 = static_cast<double>(after.logs[i]);
  if (!std::isfinite(l0 + l1)) return;
  const double slope = (l1 - l0) / to_seconds(after.t - before.t);
  pixel.slope = static_cast<float>(slope);
  pixel.brightness = static_cast<float>(l0 + slope * to_seconds(event.t - before.t));
  pixel.images_apart = after.t - before.t;
}

/// The first image between the last event of a pixel and `event`, in whose time L moves by `way` thresholds.
void ContrastFit::compare_at_image(Pixel& pixel, const Event& event, double way) const {
  const auto later = [](TimeNs t, const KeptImage& image) { return t < image.t; };
  const auto image = std::upper_bound(images_.begin(), images_.end(), pixel.last, later);
  // Without an image before the last event, there may have been others after it.
  if (image == images_.end() || image == images_.begin()) return;
  const std::size_t i = static_cast<std::size_t>(event.y) * static_cast<std::size_t>(pixels_.width()) + event.x;
  const double between_s = to_seconds(event.t - pixel.last), part = to_seconds(image->t - pixel.last) / between_s;
  // The slope needs a threshold, which is not known yet.
  const double slope = event.polarity * kTypicalThreshold * way / between_s;
  add_equation(pixel, pixel.chain.plus(event.polarity, way * part), image->t, slope,
               static_cast<double>(image->logs[i]));
}

void ContrastFit::add_equation(Pixel& pixel, const Chain& chain, TimeNs t, double slope, double brightness) const {
  if (!std::isfinite(brightness)) return;
  const Equation row{chain.on,
                     -chain.off,
                     -to_seconds(t - pixel.since),
                     slope,
                     static_cast<double>(pixel.polarity),
                     options_.find_offset ? -std::exp(-brightness) : 0.0,
                     brightness - chain.missed};
  std::size_t at = 0;
  for (std::size_t j = 0; j < kEquationSize; ++j) {
    pixel.sums[j] += row[j];
    for (std::size_t k = j; k < kEquationSize; ++k) pixel.products[at++] += row[j] * row[k];
  }
  if (++pixel.count == kStretch) close(pixel);
}

/// Ends a stretch: adds its products about their means to those of its half.
void ContrastFit::close(Pixel& pixel) {
  if (pixel.count > 2) {
    const std::size_t half = pixel.stretches++ % 2;
    std::size_t at = 0;
    for (std::size_t i = 0; i < kEquationSize; ++i) {
      for (std::size_t j = i; j < kEquationSize; ++j, ++at)
        pixel.halves[half][at] += pixel.products[at] - pixel.sums[i] * pixel.sums[j] / pixel.count;
    }
    pixel.equations[half] += pixel.count - 1;  // the constant uses up one
  }
  pixel.count = 0;
  pixel.sums = {}, pixel.products = {};
}

void ContrastFit::end_recording() {
  for (Pixel& pixel : pixels_.pixels()) {
    close(pixel);
    pixel.polarity = 0;
  }
  images_.clear();
}

ContrastFit::Result ContrastFit::finish() {
  end_recording();
  PixelThresholds pixels(pixels_.width(), pixels_.height());
  for (int y = 0; y < pixels_.height(); ++y) {
    for (int x = 0; x < pixels_.width(); ++x) pixels.add(x, y, pixels_(x, y).halves, pixels_(x, y).equations);
  }
  Result result;
  const std::optional<std::string> problem = pixels.solve();
  const auto estimate = [&](const char* name, const char* unit, PixelThresholds::Value which, double factor) {
    if (problem) return Estimate::unknown(name, unit, *problem);
    const Jackknifed& found = pixels.values()[which];
    return Estimate::found(name, unit, factor * found.value, factor * found.low(), factor * found.high(), kMovingScene);
  };
  const auto root = [&](const char* name, PixelThresholds::Value which) {  // of a variance
    if (!problem && !pixels.knows_spread())
      return Estimate::unknown(name, "", "too few pixels have enough events in two parts of the recording");
    Estimate e = estimate(name, "", which, 1);
    for (double* value : {&e.value, &e.low, &e.high}) *value = std::sqrt(std::max(0.0, *value));
    return e;
  };
  result.equations = pixels.equations(), result.pixels = pixels.pixels();
  result.residual = pixels.residual(), result.explained = pixels.explained();
  result.on = estimate("contrast_threshold_on", "", PixelThresholds::kOn, 1);
  result.off = estimate("contrast_threshold_off", "", PixelThresholds::kOff, 1);
  result.mismatch = root("threshold_mismatch", PixelThresholds::kOwnVariance);
  result.common = root("circuit.threshold_mismatch_common", PixelThresholds::kCommonVariance);
  result.delay = estimate("delay", "us", PixelThresholds::kDelay, 1e6);
  result.offset = options_.find_offset ? estimate("offset", "", PixelThresholds::kOffset, 1)
                                       : Estimate::unknown("offset", "", "it is as given");
  for (double* value : {&result.offset.value, &result.offset.low, &result.offset.high}) *value += options_.offset;
  result.dead = problem ? Estimate::unknown("dead_pixels", "", *problem) : find_dead_pixels();
  if (problem) return result;

  for (int k = 0; k < 2; ++k) {
    FittedDistribution& d = k == 0 ? result.pixels_on : result.pixels_off;
    d.title = k == 0 ? "ON thresholds of the pixels" : "OFF thresholds of the pixels", d.axis = "threshold (ln)";
    d.values = pixels.thresholds(k);
    const double mean = k == 0 ? result.on.value : result.off.value;
    const auto part = [](const Estimate& e) { return e.determined() ? e.value : 0.0; };
    d.density =
        normal_density(mean, std::hypot(part(result.mismatch), part(result.common) * mean, pixels.typical_error(k)));
  }
  return result;
}

/// Pixels without events whose neighbours have many.
Estimate ContrastFit::find_dead_pixels() const {
  std::uint64_t watched = 0, dead = 0;
  for (int y = 0; y < pixels_.height(); ++y) {
    for (int x = 0; x < pixels_.width(); ++x) {
      std::vector<double> around;
      for (int v = std::max(0, y - 1); v <= std::min(pixels_.height() - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(pixels_.width() - 1, x + 1); ++u) {
          if (u != x || v != y) around.push_back(pixels_(u, v).events);
        }
      }
      if (around.empty() || median(std::move(around)) < kManyEvents) continue;
      ++watched;
      dead += pixels_(x, y).events == 0;
    }
  }
  return fraction_estimate("dead_pixels", dead, watched, kMovingScene);
}

}  // namespace esim::inline fit

#include "esim/evaluate/brightness_errors.h"

#include <algorithm>
#include <cmath>

namespace esim::inline evaluate {

BrightnessErrors::BrightnessErrors(ReferenceBrightness& reference, int width, int height,
                                   const std::vector<Window>& windows, double contrast_threshold)
    : reference_(reference), index_(width, height, reference.pixels()), contrast_threshold_(contrast_threshold) {
  for (const Window& window : windows) {
    WindowSums sums;
    sums.span = window.span;
    sums.first = reference.first_after(window.span.start);
    sums.end = reference.first_after(window.span.end);
    sums.pixels.resize(reference.pixels().size());
    windows_.push_back(std::move(sums));
  }
}

void BrightnessErrors::add(std::span<const Segment> segments) {
  for (const Segment& segment : segments) {
    if (segment.t1 > segment.t0) add(segment);
  }
}

void BrightnessErrors::add(const Segment& segment) {
  lines_.clear();
  index_.for_each_in(segment.tile, [&](int i) {
    const PixelPosition& p = reference_.pixels()[static_cast<std::size_t>(i)];
    const double before = segment.irradiance0(p.x, p.y), after = segment.irradiance1(p.x, p.y);
    lines_.push_back({i, std::log(before + reference_.log_eps()), std::log(after + reference_.log_eps())});
  });
  if (lines_.empty()) return;
  const auto is_large = [&](const Line& line) { return std::abs(line.after - line.before) > contrast_threshold_; };
  const std::int64_t large = std::count_if(lines_.begin(), lines_.end(), is_large);
  const std::int64_t first = reference_.first_after(segment.t0), end = reference_.first_after(segment.t1);
  for (WindowSums& window : windows_) {
    if (segment.t1 > window.span.start && segment.t1 <= window.span.end) {
      window.steps += static_cast<std::int64_t>(lines_.size());
      window.large_steps += large;
    }
    compare(window, segment, std::max(first, window.first), std::min(end, window.end));
  }
}

void BrightnessErrors::compare(WindowSums& window, const Segment& segment, std::int64_t first, std::int64_t end) {
  const double duration = static_cast<double>(segment.t1 - segment.t0);
  while (first < end) {
    const std::int64_t block = first / ReferenceBrightness::kBlock, origin = block * ReferenceBrightness::kBlock;
    const std::int64_t block_end = std::min(end, origin + ReferenceBrightness::kBlock);
    const Image<float>& truth = reference_.block(block);
    const Image<Place>& places = reference_.places(block);
    for (const Line& line : lines_) {
      PixelSums& sums = window.pixels[static_cast<std::size_t>(line.pixel)];
      const float* const row = truth.row(line.pixel);
      for (std::int64_t k = first; k < block_end; ++k) {
        const double fraction = static_cast<double>(reference_.time(k) - segment.t0) / duration;
        const double error = std::abs(line.before + fraction * (line.after - line.before) - row[k - origin]);
        sums.squares += error * error;
        window.histogram.add(error);
        if (places.empty()) continue;
        PlaceError& place = window.places[static_cast<std::size_t>(places(static_cast<int>(k - origin), line.pixel))];
        place.squares += error * error;
        ++place.values;
      }
      sums.count += block_end - first;
    }
    first = block_end;
  }
}

std::vector<BrightnessError> BrightnessErrors::finish() const {
  std::vector<BrightnessError> errors;
  for (const WindowSums& window : windows_) {
    BrightnessError error;
    for (const PixelSums& sums : window.pixels) {
      error.values += sums.count;
      error.rmse.push_back(sums.count > 0 ? std::sqrt(sums.squares / static_cast<double>(sums.count)) : 0.0);
      error.mean_rmse += error.rmse.back() / static_cast<double>(window.pixels.size());
    }
    error.mean_abs = window.histogram.mean();
    error.p99_abs = window.histogram.quantile(0.99);
    error.max_abs = window.histogram.max();
    error.steps = window.steps;
    error.large_steps = window.large_steps;
    error.places = window.places;
    errors.push_back(std::move(error));
  }
  return errors;
}

}  // namespace esim::inline evaluate

#include "esim/sampling/adaptive/tile_timeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "esim/core/fast_log.h"

namespace esim::inline sampling {
namespace {

// Near a jump, the second difference on one side does not describe the interval: the curvature term is at most this
// multiple of the smaller one.
constexpr float kMaxBend = 2;

// Every third row is watched, alternating its left and its right half: errors of neighbours are similar.
constexpr int kRowsPerRun = 3;

std::size_t run_length(const Tile& tile) { return static_cast<std::size_t>((tile.width + 1) / 2); }

std::size_t watched_pixels(const Tile& tile) {
  return static_cast<std::size_t>((tile.height + kRowsPerRun - 1) / kRowsPerRun) * run_length(tile);
}

/// Calls run(k, watched) for each run of watched pixels of a tile. k is the index of its first pixel among all pixels,
/// `watched` its index among the watched ones.
template <typename Run>
void for_watched(const Tile& tile, const Run& run) {
  const auto width = static_cast<std::size_t>(tile.width);
  const std::size_t length = run_length(tile), count = watched_pixels(tile) / length;
  for (std::size_t i = 0; i < count; ++i) run(i * kRowsPerRun * width + (i % 2 == 0 ? 0 : width - length), i * length);
}

/// Copies a few pixels inline: a call would take longer than the copy.
void copy(const float* from, std::size_t count, float* to) {
#pragma omp simd
  for (std::size_t x = 0; x < count; ++x) to[x] = from[x];
}

double root_mean(float sum, std::size_t count) {
  return std::sqrt(static_cast<double>(sum) / static_cast<double>(count));
}

}  // namespace

/// The curvature c h^2 between two samples, from the second differences before and after, each a weighted sum of the
/// irradiance at three samples.
struct TileTimeline::Curvature {
  const float *before, *first, *last, *after;
  float before_outer = 0, before_near = 0, before_far = 0;
  float after_outer = 0, after_near = 0, after_far = 0;
  bool straight = true;  // no sample on one side

  /// c h^2 of pixel k.
  float operator()(std::size_t k) const {
    const float a = before_outer * before[k] + before_near * first[k] + before_far * last[k];
    const float b = after_outer * after[k] + after_near * last[k] + after_far * first[k];
    const float size_a = std::fabs(a), size_b = std::fabs(b), mean = 0.5F * (a + b);
    const float bound = kMaxBend * (size_a < size_b ? size_a : size_b);
    const float limited = mean > bound ? bound : (mean < -bound ? -bound : mean);
    return a * b > 0 ? limited : 0.0F;
  }

  /// Irradiance of pixel k at the fraction f of the interval; at least a quarter of the smaller end.
  float irradiance(std::size_t k, float f) const { return irradiance(k, (*this)(k), f); }

  /// The same with the curvature `c`.
  float irradiance(std::size_t k, float c, float f) const {
    const float e0 = first[k], e1 = last[k];
    const float e = e0 + (e1 - e0) * f - c * (0.5F * f * (1 - f)), least = 0.25F * (e0 < e1 ? e0 : e1);
    return e > least ? e : least;
  }
};

TileTimeline::Curvature TileTimeline::curvature_between(std::size_t first, std::size_t last) const {
  const bool has_before = first > 0, has_after = last + 1 < samples_.size();
  const auto values = [&](std::size_t i) { return samples_[i].irradiance.data(); };
  Curvature curvature{values(has_before ? first - 1 : first), values(first), values(last),
                      values(has_after ? last + 1 : last)};
  if (!has_before || !has_after) return curvature;
  curvature.straight = false;
  const auto h = static_cast<double>(samples_[last].t - samples_[first].t);
  // h^2 times the second divided difference of three samples, one of them at a distance `gap` from the interval.
  const auto weigh = [&](double gap, float& outer, float& near, float& far) {
    const double scale = 2 * h * h / (h + gap);
    outer = static_cast<float>(scale / gap), far = static_cast<float>(scale / h);
    near = -static_cast<float>(scale / gap + scale / h);
  };
  weigh(static_cast<double>(samples_[first].t - samples_[first - 1].t), curvature.before_outer, curvature.before_near,
        curvature.before_far);
  weigh(static_cast<double>(samples_[last + 1].t - samples_[last].t), curvature.after_outer, curvature.after_near,
        curvature.after_far);
  return curvature;
}

void TileTimeline::insert(TimeNs t, const Image<float>& irradiance) {
  Sample sample;
  if (!unused_.empty()) sample = std::move(unused_.back()), unused_.pop_back();
  const auto width = static_cast<std::size_t>(tile_.width);
  sample.t = t, sample.surprise = 0;
  sample.irradiance.resize(width * static_cast<std::size_t>(tile_.height));
  sample.brightness.resize(watched_pixels(tile_));
  for (int y = 0; y < tile_.height; ++y) {
    copy(irradiance.row(tile_.y + y) + tile_.x, width, sample.irradiance.data() + static_cast<std::size_t>(y) * width);
  }
  const float eps = log_eps_;
  const std::size_t length = run_length(tile_);
  for_watched(tile_, [&](std::size_t k, std::size_t watched) {
#pragma omp simd
    for (std::size_t x = 0; x < length; ++x)
      sample.brightness[watched + x] = fast_log(std::max(sample.irradiance[k + x] + eps, 1e-30F));
  });
  auto place = samples_.end();
  while (place != samples_.begin() && std::prev(place)->t > t) --place;
  place = samples_.insert(place, std::move(sample));
  const auto at = static_cast<std::size_t>(place - samples_.begin());
  for (std::size_t i = at == 0 ? 0 : at - 1; i <= at + 1 && i < samples_.size(); ++i) measure(i);
}

void TileTimeline::prefetch() const {
  constexpr std::size_t kPerLine = 64 / sizeof(float), kWanted = 2;
  for (std::size_t i = samples_.size() - std::min(samples_.size(), kWanted); i < samples_.size(); ++i) {
    for (const LargeVector<float>* values : {&samples_[i].irradiance, &samples_[i].brightness})
      for (std::size_t k = 0; k < values->size(); k += kPerLine) __builtin_prefetch(values->data() + k);
  }
}

std::size_t TileTimeline::forget_before(std::size_t i) {
  if (i < 2) return i;
  const auto last = samples_.begin() + static_cast<std::ptrdiff_t>(i) - 1;
  std::move(samples_.begin(), last, std::back_inserter(unused_));
  samples_.erase(samples_.begin(), last);
  return 1;
}

void TileTimeline::errors(std::size_t i, std::vector<float>& out) const {
  const Curvature curvature = curvature_between(i - 1, i + 1);
  const TimeNs t0 = samples_[i - 1].t, t1 = samples_[i + 1].t;
  const auto f = static_cast<float>(static_cast<double>(samples_[i].t - t0) / static_cast<double>(t1 - t0));
  const float* const seen = samples_[i].brightness.data();
  const float eps = log_eps_;
  const std::size_t length = run_length(tile_);
  out.resize(samples_[i].brightness.size());
  const auto compare = [&](const auto& irradiance) {
    for_watched(tile_, [&](std::size_t k, std::size_t watched) {
#pragma omp simd
      for (std::size_t x = 0; x < length; ++x) {
        out[watched + x] = fast_log(std::max(irradiance(k + x) + eps, 1e-30F)) - seen[watched + x];
      }
    });
  };
  if (curvature.straight) {
    compare([&](std::size_t k) { return curvature.first[k] + (curvature.last[k] - curvature.first[k]) * f; });
  } else {
    compare([&](std::size_t k) { return curvature.irradiance(k, f); });
  }
}

/// Computes a sample's prediction error and its bend.
void TileTimeline::measure(std::size_t i) {
  if (i == 0 || i + 1 >= samples_.size()) return;
  errors(i, errors_);
  const Sample &before = samples_[i - 1], &after = samples_[i + 1];
  Sample& sample = samples_[i];
  const auto f = static_cast<float>(static_cast<double>(sample.t - before.t) / static_cast<double>(after.t - before.t));
  const float *const l0 = before.brightness.data(), *const l = sample.brightness.data(),
                     *const l1 = after.brightness.data();
  float error = 0, bend = 0;
#pragma omp simd reduction(+ : error, bend)
  for (std::size_t k = 0; k < errors_.size(); ++k) {
    const float off = l[k] - (l0[k] + (l1[k] - l0[k]) * f);
    error += errors_[k] * errors_[k], bend += off * off;
  }
  sample.surprise = root_mean(error, errors_.size()), sample.bend = root_mean(bend, errors_.size());
}

double TileTimeline::curvature(std::size_t i) const {
  const auto h = static_cast<double>(time(i + 1) - time(i));
  // Scales a sample's bend, which spans the intervals on both sides, to this interval: it is proportional to the square
  // of the length.
  const auto of = [&](std::size_t k) {
    const auto left = static_cast<double>(time(k) - time(k - 1)), right = static_cast<double>(time(k + 1) - time(k));
    return samples_[k].bend * h * h / (4 * left * right);
  };
  const bool has_before = i > 0, has_after = i + 2 < size();
  if (!has_before || !has_after) return has_before ? of(i) : (has_after ? of(i + 1) : 0);
  const double a = of(i), b = of(i + 1);
  return std::min(a, b);
}

void TileTimeline::write_half(std::size_t i, float* half) const {
  const Curvature curvature = curvature_between(i, i + 1);
  const std::size_t count = samples_[i].irradiance.size();
#pragma omp simd
  for (std::size_t k = 0; k < count; ++k) half[k] = curvature.irradiance(k, 0.5F);
}

void TileTimeline::write_quarters(std::size_t i, const std::array<float*, 3>& quarters) const {
  const Curvature curvature = curvature_between(i, i + 1);
  const std::size_t count = samples_[i].irradiance.size();
  float *const first = quarters[0], *const half = quarters[1], *const last = quarters[2];
#pragma omp simd
  for (std::size_t k = 0; k < count; ++k) {
    const float c = curvature(k);
    first[k] = curvature.irradiance(k, c, 0.25F);
    half[k] = curvature.irradiance(k, c, 0.5F);
    last[k] = curvature.irradiance(k, c, 0.75F);
  }
}

}  // namespace esim::inline sampling

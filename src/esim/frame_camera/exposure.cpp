#include "esim/frame_camera/exposure.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "esim/core/vector_math.h"

namespace esim::inline frame_camera {
namespace {

/// sum += w0 E0 + w1 E1. False if an irradiance is not a finite number >= 0.
bool add_row(std::size_t count, float w0, const float* e0, float w1, const float* e1, float* sum) {
  bool good = true;
  const auto run = [&](auto d, std::size_t from, std::size_t to) {
    const auto weight0 = hn::Set(d, w0), weight1 = hn::Set(d, w1);
    IrradianceCheck check(d);
    for (std::size_t x = from; x < to; x += hn::Lanes(d)) {
      const auto first = hn::LoadU(d, e0 + x), last = hn::LoadU(d, e1 + x);
      check.see(d, first), check.see(d, last);
      hn::StoreU(hn::MulAdd(weight1, last, hn::MulAdd(weight0, first, hn::LoadU(d, sum + x))), d, sum + x);
    }
    good &= check.passed();
  };
  const hn::ScalableTag<float> whole;
  const std::size_t in_vectors = count - count % hn::Lanes(whole);
  run(whole, 0, in_vectors);
  run(hn::CappedTag<float, 1>(), in_vectors, count);
  return good;
}

}  // namespace

void Exposure::open(Image<float> memory) {
  mean_ = std::move(memory);
  mean_.fill(0);
}

/// Weights of a segment's ends in the mean of a row whose exposure begins at `begin`.
Exposure::Weights Exposure::weigh(const Segment& segment, TimeNs begin, const SceneLight* light,
                                  std::size_t which) const {
  const TimeNs from = std::max(segment.t0, begin), to = std::min(segment.t1, begin + duration_);
  if (from >= to) return {0, 0};
  if (light != nullptr) {
    const auto [m, tm] = light->integrals(from, to, which);
    const double late = (to_seconds(from - segment.t0) * m + tm) / to_seconds(segment.t1 - segment.t0);
    return {static_cast<float>((m - late) / to_seconds(duration_)), static_cast<float>(late / to_seconds(duration_))};
  }
  // The mean over the overlap is E in its middle.
  const double fraction = static_cast<double>(to - from) / static_cast<double>(duration_);
  const double twice_middle = static_cast<double>(from - segment.t0) + static_cast<double>(to - segment.t0);
  const double middle = twice_middle / (2 * static_cast<double>(segment.t1 - segment.t0));
  return {static_cast<float>(fraction * (1 - middle)), static_cast<float>(fraction * middle)};
}

/// Adds a row whose pixels see several lights.
bool Exposure::add_lights(const Segment& segment, int y, const SegmentLight& light, std::span<const Weights> weights) {
  bool good = true;
  const auto valid = [](float e) { return e >= 0 && e <= std::numeric_limits<float>::max(); };
  float* const mean = mean_.row(y);
  for (int x = segment.tile.x; x < segment.tile.x + segment.tile.width; ++x) {
    const float e0 = segment.irradiance0(x, y), e1 = segment.irradiance1(x, y);
    good &= valid(e0) && valid(e1);
    mean[x] += weights[light.scene->light_of(light.before(x, y))].first * e0 +
               weights[light.scene->light_of(light.after(x, y))].last * e1;
  }
  return good;
}

bool Exposure::add(const Segment& segment, Rows rows, const SegmentLight* light) {
  const auto width = static_cast<std::size_t>(segment.tile.width);
  const SceneLight* const scene = light != nullptr ? light->scene : nullptr;
  std::vector<Weights> weights(scene != nullptr ? scene->lights() : 1);
  std::optional<TimeNs> weighed;  // the beginning of the exposure that the weights are for
  bool good = true;
  for (int y = rows.first; y < rows.last; ++y) {
    const TimeNs begin = first_row_ + row_delays_[static_cast<std::size_t>(y)];
    if (std::max(segment.t0, begin) >= std::min(segment.t1, begin + duration_)) continue;
    if (begin != weighed) {
      for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = weigh(segment, begin, scene, i);
    }
    weighed = begin;
    if (weights.size() > 1) {
      good &= add_lights(segment, y, *light, weights);
      continue;
    }
    good &= add_row(width, weights[0].first, segment.irradiance0.row(y) + segment.tile.x, weights[0].last,
                    segment.irradiance1.row(y) + segment.tile.x, mean_.row(y) + segment.tile.x);
  }
  return good;
}

}  // namespace esim::inline frame_camera

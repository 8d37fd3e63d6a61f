#include "esim/frame_camera/exposure.h"

#include <algorithm>
#include <utility>

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
Exposure::Weights Exposure::weigh(const Segment& segment, TimeNs begin) const {
  const TimeNs from = std::max(segment.t0, begin), to = std::min(segment.t1, begin + duration_);
  if (from >= to) return {begin, 0, 0};
  // The mean over the overlap is E in its middle.
  const double fraction = static_cast<double>(to - from) / static_cast<double>(duration_);
  const double twice_middle = static_cast<double>(from - segment.t0) + static_cast<double>(to - segment.t0);
  const double middle = twice_middle / (2 * static_cast<double>(segment.t1 - segment.t0));
  return {begin, static_cast<float>(fraction * (1 - middle)), static_cast<float>(fraction * middle)};
}

bool Exposure::add(const Segment& segment, Rows rows) {
  const auto width = static_cast<std::size_t>(segment.tile.width);
  Weights weights = weigh(segment, first_row_);
  bool good = true;
  for (int y = rows.first; y < rows.last; ++y) {
    const TimeNs begin = first_row_ + row_delays_[static_cast<std::size_t>(y)];
    if (begin != weights.begin) weights = weigh(segment, begin);
    if (weights.first + weights.last == 0) continue;
    good &= add_row(width, weights.first, segment.irradiance0.row(y) + segment.tile.x, weights.last,
                    segment.irradiance1.row(y) + segment.tile.x, mean_.row(y) + segment.tile.x);
  }
  return good;
}

}  // namespace esim::inline frame_camera

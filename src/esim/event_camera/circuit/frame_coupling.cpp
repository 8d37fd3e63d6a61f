#include "esim/event_camera/circuit/frame_coupling.h"

#include <algorithm>
#include <cmath>

namespace esim::inline event_camera {
namespace {

/// The irradiance of a segment's tile at a time within it.
Image<float> irradiance_at(const Segment& segment, TimeNs t) {
  const Tile& tile = segment.tile;
  const auto part =
      static_cast<float>(static_cast<double>(t - segment.t0) / static_cast<double>(segment.t1 - segment.t0));
  Image<float> image(tile.width, tile.height);
  for (int y = 0; y < tile.height; ++y) {
    const float *const e0 = segment.irradiance0.row(tile.y + y) + tile.x, *const e1 =
                                                                              segment.irradiance1.row(tile.y + y) +
                                                                              tile.x;
    float* const out = image.row(y);
    for (int x = 0; x < tile.width; ++x) out[x] = e0[x] + part * (e1[x] - e0[x]);
  }
  return image;
}

}  // namespace

Ramp FrameCoupling::at(double t) const {
  // The frame that began last.
  double frame = std::floor((t - offset_ + 0.5 * static_cast<double>(exposure_)) / period_);
  while (static_cast<double>(start(frame + 1)) <= t) ++frame;
  while (static_cast<double>(start(frame)) > t) --frame;
  if (frame < first_) return {};
  const double since = t - static_cast<double>(start(frame)), end = static_cast<double>(exposure_);
  const double fall = coupling_ / static_cast<double>(kFall), rise = coupling_ / static_cast<double>(kRise);
  if (since < static_cast<double>(kFall)) return {-fall * since, -fall};
  if (since < end) return {-coupling_, 0};
  if (since < end + static_cast<double>(kRise)) return {-coupling_ + rise * (since - end), rise};
  return {};
}

TimeNs FrameCoupling::next_corner(TimeNs t) const {
  for (double frame = std::max(first_, std::floor((static_cast<double>(t) - offset_) / period_) - 1);; ++frame) {
    const TimeNs begin = start(frame), end = begin + exposure_;
    for (const TimeNs corner : {begin, begin + kFall, end, end + kRise}) {
      if (corner > t) return corner;
    }
  }
}

std::span<const Segment> CornerDivider::divide(std::span<const Segment> segments, const FrameCoupling& coupling,
                                               TimeNs epoch) {
  divided_.clear();
  images_.clear();
  for (const Segment& segment : segments) {
    Segment rest = segment;
    while (rest.t0 < rest.t1) {
      const TimeNs corner = epoch + coupling.next_corner(rest.t0 - epoch);
      if (corner >= rest.t1) break;
      const ImageView<float> there(images_.emplace_back(irradiance_at(segment, corner)).data(), segment.tile);
      divided_.push_back({segment.tile, rest.t0, corner, rest.irradiance0, there});
      rest.t0 = corner;
      rest.irradiance0 = there;
    }
    divided_.push_back(rest);
  }
  return divided_;
}

}  // namespace esim::inline event_camera

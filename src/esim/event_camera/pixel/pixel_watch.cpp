#include "esim/event_camera/pixel/pixel_watch.h"

#include "esim/core/vector_math.h"
#include "esim/event_camera/pixel/pixel_block.h"

namespace esim::inline event_camera {
namespace {

using WatchTag = hn::CappedTag<float, 8>;

}  // namespace

bool PixelWatch::look(const PixelArray& pixels, const Segment& segment, Rows rows) {
  first_ = rows.first;
  ends_.assign(1, 0);
  const std::size_t most = static_cast<std::size_t>(segment.tile.width) * static_cast<std::size_t>(rows.count());
  if (columns_.size() < most + kVectorPadding) columns_.resize(most + kVectorPadding);
  std::size_t count = 0;
  for (int y = rows.first; y < rows.last; ++y) {
    const std::size_t before = count;
    if (!look_at_row(pixels, segment, y, count)) return false;
    ends_.push_back(count);
    // Prefetch the pixels of later rows while this row is processed.
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.width);
    const float* const light0 = segment.irradiance0.row(y);
    for (std::size_t i = before; i < count; ++i) {
      pixels.prefetch(row + columns_[i]);
      __builtin_prefetch(light0 + columns_[i]);
    }
  }
  return true;
}

bool PixelWatch::look_at_row(const PixelArray& pixels, const Segment& segment, int y, std::size_t& count) {
  const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.width);
  const float* const irradiance = segment.irradiance1.row(y);
  const float *const low = pixels.bound_low.data() + row, *const high = pixels.bound_high.data() + row;
  const std::int32_t* const timers = pixels.effects.timers ? pixels.timers.data() + row : nullptr;
  const std::int32_t now = pixels.effects.timers ? pixels.ticks(segment.t1) : 0;
  std::uint32_t* const columns = columns_.data();
  std::size_t found = count;
  bool valid = true;

  // Without branches: active pixels are as hard to predict as events.
  const auto look_at = [&](auto d, int from, int to) {
    const hn::RebindToSigned<decltype(d)> di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    IrradianceCheck check(d);
    for (int x = from; x + lanes <= to; x += lanes) {
      const auto value = hn::LoadU(d, irradiance + x);
      check.see(d, value);
      auto active = hn::Not(hn::And(hn::Gt(value, hn::LoadU(d, low + x)), hn::Lt(value, hn::LoadU(d, high + x))));
      if (timers != nullptr) {
        const auto expired = hn::Lt(hn::LoadU(di, timers + x), hn::Set(di, now + 1));
        active = hn::Or(active, hn::RebindMask(d, expired));
      }
      const ChosenLanes chosen(d, active);
      chosen.store_positions(static_cast<std::uint32_t>(x), columns + found);
      found += chosen.count();
    }
    valid &= check.passed();
  };
  const WatchTag whole;
  const int first = segment.tile.x, last = first + segment.tile.width;
  const int middle = last - segment.tile.width % static_cast<int>(hn::Lanes(whole));
  look_at(whole, first, middle);
  look_at(hn::CappedTag<float, 1>(), middle, last);
  count = found;
  return valid;
}

}  // namespace esim::inline event_camera

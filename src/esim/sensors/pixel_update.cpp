#include "esim/sensors/pixel_update.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "esim/sensors/front_end.h"
#include "esim/sensors/vector_math.h"

namespace esim {
namespace {

// Pixels that go through a segment together: enough for vectors, few enough for the cache.
constexpr std::size_t kBatch = 192;

/// Lanes whose alarm goes off by `now`, in ticks.
template <class D>
hn::Mask<D> alarmed(D d, const std::int32_t* alarms, std::int32_t now) {
  const hn::RebindToSigned<D> di;
  return hn::RebindMask(d, hn::Lt(hn::LoadU(di, alarms), hn::Set(di, now + 1)));
}

AwakePixel awake_pixel(const PixelArray& pixels, const Segment& segment, int x, int y) {
  const auto pixel =
      static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(pixels.width) + static_cast<std::uint32_t>(x);
  pixels.prefetch(pixel);
  return {pixel, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), segment.irradiance0->row(y)[x],
          segment.irradiance1->row(y)[x]};
}

std::size_t index(const PixelArray& pixels, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.width) + static_cast<std::size_t>(x);
}

/// Asks memory for a row of the new irradiance while the row before is worked on.
void prefetch_row(const Segment& segment, int y) {
  constexpr int kPerLine = 64 / sizeof(float);
  const float* const row = segment.irradiance1->row(y) + segment.tile.x;
  for (int x = 0; x < segment.tile.width; x += kPerLine) __builtin_prefetch(row + x);
}

}  // namespace

/// What all pixels of a segment have in common.
struct PixelUpdate::Filter {
  float phase_per_light = 0, phase_in_dark = 0;  // time constants that the segment lasts: per 6 of light, and besides
  double duration = 0, per_duration = 0;         // ns
  std::int32_t now = 0;                          // for the alarms, in ticks

  Filter(const PixelArray& pixels, const Segment& segment)
      : duration(static_cast<double>(segment.t1 - segment.t0)), per_duration(1 / duration) {
    const EventCameraOptions& o = pixels.options;
    const double per_pole = o.low_pass_order == 2 ? 1 / std::sqrt(std::numbers::sqrt2 - 1) : 1;  // -3 dB of both
    const double at_white = 2 * std::numbers::pi * o.low_pass_hz * per_pole * duration * 1e-9;
    const double per_light = at_white / (1 + o.dark_irradiance);
    phase_per_light = static_cast<float>(per_light / 6);
    phase_in_dark = static_cast<float>(per_light * o.dark_irradiance);
    if (pixels.alarmed) now = pixels.ticks(segment.t1);
  }
};

/// Moves some neighbouring pixels' low-passes to the segment's end, exactly for brightness that is linear in time and
/// for the segment's mean intensity, and wakes those that may have left their band on the way.
template <int kOrder, class D>
HWY_INLINE void PixelUpdate::filter_vector(D d, PixelArray& pixels, const Segment& segment, const Filter& filter,
                                           const float* brightness, int y, int x) {
  using V = hn::Vec<D>;
  const std::size_t i = index(pixels, x, y);
  const V start = hn::LoadU(d, &pixels.brightness[i]), end = hn::LoadU(d, brightness);
  hn::StoreU(end, d, &pixels.brightness[i]);
  V lowest = hn::Min(start, end), highest = hn::Max(start, end);
  V phase = hn::Zero(d), m = phase, f1 = start, f2 = start;

  if constexpr (kOrder > 0) {
    // How many time constants the segment lasts: of the mean light, by Simpson's rule for an exponential.
    const V e0 = hn::LoadU(d, segment.irradiance0->row(y) + x), e1 = hn::LoadU(d, segment.irradiance1->row(y) + x);
    const V sum = hn::MulAdd(hn::Set(d, 4.0F), hn::Sqrt(hn::Mul(e0, e1)), hn::Add(e0, e1));
    phase = hn::MulAdd(sum, hn::Set(d, filter.phase_per_light), hn::Set(d, filter.phase_in_dark));

    // With m = 1 - exp(-phase): F moves by m of its distance, and lags behind the rise of L.
    const V one = hn::Set(d, 1.0F), rise = hn::Sub(end, start);
    m = hn::Neg(hn::Expm1(d, hn::Neg(phase)));
    const V followed = hn::Div(m, phase);
    f1 = hn::LoadU(d, &pixels.filtered1[i]);
    const V distance = hn::Sub(start, f1);
    const V f1_end = hn::Add(f1, hn::MulAdd(m, distance, hn::Mul(rise, hn::Sub(one, followed))));
    hn::StoreU(f1_end, d, &pixels.filtered1[i]);
    if constexpr (kOrder == 1) {
      // Where F does not turn back, it stays between its ends.
      const auto turns = hn::Lt(hn::Mul(distance, hn::Sub(end, f1_end)), hn::Zero(d));
      lowest = hn::Min(hn::Min(f1, f1_end), hn::IfThenElse(turns, lowest, f1_end));
      highest = hn::Max(hn::Max(f1, f1_end), hn::IfThenElse(turns, highest, f1_end));
    } else {
      f2 = hn::LoadU(d, &pixels.filtered2[i]);
      const V from_first = hn::Mul(hn::Mul(phase, hn::Sub(one, m)), hn::Neg(distance));
      const V from_rise = hn::Mul(rise, hn::Add(hn::MulAdd(hn::Set(d, -2.0F), followed, one), hn::Sub(one, m)));
      const V f2_end = hn::Add(hn::MulAdd(m, hn::Sub(start, f2), f2), hn::Add(from_first, from_rise));
      hn::StoreU(f2_end, d, &pixels.filtered2[i]);
      lowest = hn::Min(hn::Min(f2, f2_end), hn::Min(f1, lowest));
      highest = hn::Max(hn::Max(f2, f2_end), hn::Max(f1, highest));
    }
  }

  auto restless =
      hn::Or(hn::Le(lowest, hn::LoadU(d, &pixels.band_low[i])), hn::Ge(highest, hn::LoadU(d, &pixels.band_high[i])));
  if (pixels.alarmed) restless = hn::Or(restless, alarmed(d, &pixels.alarms[i], filter.now));
  // Without a branch: that a pixel wakes is as hard to foresee as an event.
  const ChosenLanes chosen(d, restless);
  Woken& w = woken_;
  chosen.store_positions(x, w.column.data() + w.count);
  chosen.store(start, w.start.data() + w.count);
  chosen.store(end, w.end.data() + w.count);
  if constexpr (kOrder > 0) {
    chosen.store(f1, w.filtered1.data() + w.count);
    chosen.store(phase, w.phase.data() + w.count);
    chosen.store(m, w.moved.data() + w.count);
  }
  if constexpr (kOrder == 2) chosen.store(f2, w.filtered2.data() + w.count);
  w.count += chosen.count();
}

/// Hands the pixels of a row that woke up over to their passes.
template <int kOrder>
void PixelUpdate::take_woken(PixelArray& pixels, const Segment& segment, const Filter& filter, int y) {
  const Woken& w = woken_;
  for (std::size_t i = 0; i < w.count; ++i) {
    const AwakePixel awake = awake_pixel(pixels, segment, static_cast<int>(w.column[i]), y);
    const double from = w.start[i], slope = (static_cast<double>(w.end[i]) - from) * filter.per_duration;
    if constexpr (kOrder == 0) {
      linear_.add(awake, {from, slope});
    } else {
      const double rate = w.phase[i] * filter.per_duration, moved = w.moved[i];
      relaxing_.add(
          awake, kOrder == 1 ? RelaxingSignal::first_order(rate, moved, w.filtered1[i], from, slope)
                             : RelaxingSignal::second_order(rate, moved, w.filtered1[i], w.filtered2[i], from, slope));
    }
  }
}

const float* PixelUpdate::brightness_row(const PixelArray& pixels, const Segment& segment,
                                         const Image<float>* brightness, int y) {
  if (brightness != nullptr) return brightness->row(y) + segment.tile.x;
  const auto length = static_cast<std::size_t>(segment.tile.width);
  row_.resize(length);
  respond(pixels.options, length, segment.irradiance1->row(y) + segment.tile.x, row_.data());
  return row_.data();
}

template <int kOrder>
void PixelUpdate::filter_row(PixelArray& pixels, const Segment& segment, const Filter& filter,
                             const Image<float>* brightness, int y) {
  const int first = segment.tile.x, last = first + segment.tile.width;
  const float* const row = brightness_row(pixels, segment, brightness, y);
  const hn::CappedTag<float, 8> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  woken_.begin(static_cast<std::size_t>(segment.tile.width) + kVectorPadding);
  int x = first;
  for (; x + lanes <= last; x += lanes) filter_vector<kOrder>(d, pixels, segment, filter, row + (x - first), y, x);
  for (; x < last; ++x)
    filter_vector<kOrder>(hn::CappedTag<float, 1>(), pixels, segment, filter, row + (x - first), y, x);
  take_woken<kOrder>(pixels, segment, filter, y);
}

/// Where bands are of brightness: moves all low-passes on, and takes those pixels through the segment whose filtered
/// brightness may leave its band.
bool PixelUpdate::filter(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows,
                         PackedEvents& events) {
  const Filter common(pixels, segment);
  const int order = pixels.options.low_pass_hz > 0 ? pixels.options.low_pass_order : 0;
  const auto width = static_cast<std::size_t>(segment.tile.width);
  for (int y = rows.first; y < rows.last; ++y) {
    if (!all_irradiance(segment, {y, y + 1})) return false;
    if (y + 1 < rows.last) prefetch_row(segment, y + 1);
    order == 0 ? linear_.reserve(width) : relaxing_.reserve(width);
    if (order == 0) filter_row<0>(pixels, segment, common, brightness, y);
    if (order == 1) filter_row<1>(pixels, segment, common, brightness, y);
    if (order == 2) filter_row<2>(pixels, segment, common, brightness, y);
    const bool last = y + 1 == rows.last;
    if (linear_.count() >= kBatch || last) linear_.run(pixels, segment.t0, segment.t1, events);
    if (relaxing_.count() >= kBatch || last) relaxing_.run(pixels, segment.t0, segment.t1, events);
  }
  return true;
}

/// Where bands are of irradiance: takes the pixels through the segment that wake up in it.
bool PixelUpdate::cross(PixelArray& pixels, const Segment& segment, Rows rows, PackedEvents& events) {
  if (!watch_.look(pixels, segment, rows)) return false;
  if (CleanPass::serves(pixels)) {
    clean_.run(pixels, segment, watch_, rows, events);
    return true;
  }
  linear_.reserve(watch_.count());
  for (int y = rows.first; y < rows.last; ++y) {
    for (const std::uint32_t x : watch_.columns(y)) linear_.add(awake_pixel(pixels, segment, static_cast<int>(x), y));
  }
  const std::size_t count = linear_.count();
  if (before_.size() < count + kVectorPadding) {
    before_.resize(2 * count + kVectorPadding, 1.0), after_.resize(2 * count + kVectorPadding, 1.0);
  }
  const double eps = pixels.options.log_eps;
  for (std::size_t i = 0; i < count; ++i) {
    before_[i] = linear_.pixel(i).light0 + eps;
    after_[i] = linear_.pixel(i).light1 + eps;
  }
  logarithms(count, before_.data());
  logarithms(count, after_.data());
  const double per_ns = 1.0 / static_cast<double>(segment.t1 - segment.t0);
  for (std::size_t i = 0; i < count; ++i) linear_.signal(i) = {before_[i], (after_[i] - before_[i]) * per_ns};
  linear_.run(pixels, segment.t0, segment.t1, events);
  return true;
}

bool PixelUpdate::advance(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows,
                          PackedEvents& events) {
  return pixels.in_brightness ? filter(pixels, segment, brightness, rows, events)
                              : cross(pixels, segment, rows, events);
}

bool PixelUpdate::open(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows) {
  if (!all_irradiance(segment, rows)) return false;
  linear_.reserve(static_cast<std::size_t>(segment.tile.width) * static_cast<std::size_t>(rows.count()));
  const auto width = static_cast<std::size_t>(segment.tile.width);
  if (after_.size() < width + kVectorPadding) after_.resize(width + kVectorPadding, 1.0);
  for (int y = rows.first; y < rows.last; ++y) {
    if (pixels.in_brightness) {
      const float* const row = brightness_row(pixels, segment, brightness, y);
      std::copy_n(row, width, after_.data());
    } else {
      const float* const row = segment.irradiance1->row(y) + segment.tile.x;
      for (std::size_t i = 0; i < width; ++i) after_[i] = row[i] + pixels.options.log_eps;
      logarithms(width, after_.data());
    }
    if (CleanPass::serves(pixels)) {
      clean_.open(pixels, static_cast<std::uint32_t>(index(pixels, segment.tile.x, y)), {after_.data(), width});
      continue;
    }
    for (int i = 0; i < segment.tile.width; ++i) {
      const AwakePixel awake = awake_pixel(pixels, segment, segment.tile.x + i, y);
      linear_.add(awake, {pixels.open(awake.pixel, after_[static_cast<std::size_t>(i)], segment.t0), 0.0});
    }
  }
  linear_.settle_all(pixels, segment.t0);
  return true;
}

}  // namespace esim

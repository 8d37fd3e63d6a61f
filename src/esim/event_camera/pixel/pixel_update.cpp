#include "esim/event_camera/pixel/pixel_update.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "esim/core/vector_math.h"
#include "esim/event_camera/front_end.h"
#include "esim/render/irradiance_check.h"

namespace esim::inline event_camera {
namespace {

std::size_t index(const PixelArray& pixels, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.width) + static_cast<std::size_t>(x);
}

/// Prefetches a row of the new irradiance while the previous row is processed.
void prefetch_row(const Segment& segment, int y) {
  constexpr int kPerLine = 64 / sizeof(float);
  const float* const row = segment.irradiance1.row(y) + segment.tile.x;
  for (int x = 0; x < segment.tile.width; x += kPerLine) __builtin_prefetch(row + x);
}

}  // namespace

/// Values that all pixels of a segment share.
struct PixelUpdate::Filter {
  float phase_per_light = 0, phase_in_dark = 0;  // time constants: per 6 units of irradiance, and constant
  double duration = 0, per_duration = 0;         // ns
  std::int32_t later = 0;                        // timers below this value expire, in ticks

  Filter(const PixelArray& pixels, const Segment& segment)
      : duration(static_cast<double>(segment.t1 - segment.t0)), per_duration(1 / duration) {
    const EventCameraOptions& o = pixels.options;
    const double per_pole = o.low_pass_order == 2 ? 1 / std::sqrt(std::numbers::sqrt2 - 1) : 1;  // -3 dB together
    const double at_white = 2 * std::numbers::pi * o.low_pass_hz * per_pole * duration * 1e-9;
    const double per_light = at_white / (1 + o.dark_irradiance);
    phase_per_light = static_cast<float>(per_light / 6);
    phase_in_dark = static_cast<float>(per_light * o.dark_irradiance);
    if (pixels.effects.timers) later = pixels.ticks(segment.t1) + 1;
  }

  /// Duration of the segment in time constants, at the mean irradiance: Simpson's rule for an exponential.
  template <class D>
  hn::Vec<D> phase(D d, hn::Vec<D> light0, hn::Vec<D> light1) const {
    const auto sum = hn::MulAdd(hn::Set(d, 4.0F), hn::Sqrt(hn::Mul(light0, light1)), hn::Add(light0, light1));
    return hn::MulAdd(sum, hn::Set(d, phase_per_light), hn::Set(d, phase_in_dark));
  }
};

/// Pointers to a row's pixels, from the tile's first on.
struct PixelUpdate::FilterRow {
  const float *light0, *light1, *end;    // irradiance at both ends of the segment, brightness at its end
  float *start, *filtered1, *filtered2;  // brightness at its start, and after each pole: to be advanced
  const float *bound_low, *bound_high;
  const std::int32_t* timers;  // timers, or null
  std::uint32_t pixel, place;  // of the first pixel
  // Storage of the past segment for filtered1, filtered2, start and end, or null.
  float *past1 = nullptr, *past2 = nullptr, *past_start = nullptr, *past_end = nullptr;

  /// Stores a row in the past segment.
  void keep_in(PastSegment& past, int y) {
    const auto row = [&](Image<float>& image) { return image.empty() ? nullptr : image.row(y); };
    past1 = row(past.filtered1), past2 = row(past.filtered2), past_start = row(past.start), past_end = row(past.end);
  }
  void keep_ends(int begin, std::size_t count) const {
    if (past_start == nullptr) return;
    std::copy_n(start + begin, count, past_start + begin);
    std::copy_n(end + begin, count, past_end + begin);
  }

  /// Prefetches the next data: hardware prefetchers stop at page boundaries.
  template <int kOrder>
  void prefetch(int x) const {
    constexpr int kAhead = 512;
    for (const float* values : {static_cast<const float*>(start), bound_low, bound_high, light0}) {
      __builtin_prefetch(values + x + kAhead);
    }
    if constexpr (kOrder > 0) __builtin_prefetch(filtered1 + x + kAhead);
    if constexpr (kOrder > 1) __builtin_prefetch(filtered2 + x + kAhead);
    if (timers != nullptr) __builtin_prefetch(timers + x + kAhead);
  }
};

/// Advances the low-passes of some neighbouring pixels to the segment's end, exactly for brightness that is linear in
/// time and for the segment's mean intensity, and finds the pixels that may have left their bounds.
template <int kOrder, class D>
HWY_INLINE void PixelUpdate::move_vector(D d, const FilterRow& row, const Filter& filter, int x, int at) {
  using V = hn::Vec<D>;
  const hn::RebindToSigned<D> di;
  const V start = hn::LoadU(d, row.start + x), end = hn::LoadU(d, row.end + x);
  V lowest = hn::Min(start, end), highest = hn::Max(start, end);
  if constexpr (kOrder > 0) {
    const V phase = filter.phase(d, hn::LoadU(d, row.light0 + x), hn::LoadU(d, row.light1 + x));

    // With m = 1 - exp(-phase): F covers the fraction m of its distance, and lags the rise of L.
    const V one = hn::Set(d, 1.0F), rise = hn::Sub(end, start), m = moved_after(d, phase), followed = hn::Div(m, phase);
    const V f1 = hn::LoadU(d, row.filtered1 + x), distance = hn::Sub(start, f1);
    if (row.past1 != nullptr) hn::StoreU(f1, d, row.past1 + x);
    const V f1_end = hn::Add(f1, hn::MulAdd(m, distance, hn::Mul(rise, hn::Sub(one, followed))));
    hn::StoreU(phase, d, moved_.phase.data() + at);
    hn::StoreU(m, d, moved_.moved.data() + at);
    hn::StoreU(f1_end, d, moved_.filtered1.data() + at);
    if constexpr (kOrder == 1) {
      // F stays between its ends, or has an extremum where it meets L, which is limited by L's start and by the
      // tangents at F's ends.
      const V tangent0 = hn::MulAdd(distance, phase, f1), tangent1 = hn::NegMulAdd(hn::Sub(end, f1_end), phase, f1_end);
      lowest = hn::Min(hn::Min(f1, f1_end), hn::Max(hn::Max(start, tangent0), tangent1));
      highest = hn::Max(hn::Max(f1, f1_end), hn::Min(hn::Min(start, tangent0), tangent1));
    } else {
      const V f2 = hn::LoadU(d, row.filtered2 + x);
      if (row.past2 != nullptr) hn::StoreU(f2, d, row.past2 + x);
      const V from_rise = hn::Mul(rise, hn::Add(hn::MulAdd(hn::Set(d, -2.0F), followed, one), hn::Sub(one, m)));
      // Not as a sum of two products: compilers may fuse either of them.
      const V from_both = hn::NegMulAdd(hn::Mul(phase, hn::Sub(one, m)), distance, from_rise);
      const V f2_end = hn::Add(hn::MulAdd(m, hn::Sub(start, f2), f2), from_both);
      hn::StoreU(f2_end, d, moved_.filtered2.data() + at);
      lowest = hn::Min(hn::Min(f2, f2_end), hn::Min(f1, lowest));
      highest = hn::Max(hn::Max(f2, f2_end), hn::Max(f1, highest));
    }
  }
  auto leaving =
      hn::Or(hn::Le(lowest, hn::LoadU(d, row.bound_low + x)), hn::Ge(highest, hn::LoadU(d, row.bound_high + x)));
  if (row.timers != nullptr) {
    const auto expired = hn::Lt(hn::LoadU(di, row.timers + x), hn::Set(di, filter.later));
    leaving = hn::Or(leaving, hn::RebindMask(d, expired));
  }
  moved_.leaving[static_cast<std::size_t>(at) / hn::Lanes(d)] = ChosenLanes<D>::bits_of(d, leaving);
}

/// Advances the low-passes of pixels from x = begin on, and returns the columns that become active.
template <int kOrder, class D>
std::span<const std::uint32_t> PixelUpdate::move(D d, const PixelArray& pixels, const FilterRow& row,
                                                 const Filter& filter, int begin, int end) {
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int x = begin; x < end; x += lanes) {
    move_vector<kOrder>(d, row, filter, x, x - begin);
    row.prefetch<kOrder>(x);
    // Prefetch the previous active pixels, a few at a time.
    pixels.prefetch(active_.pixel[prefetched_]), pixels.prefetch(active_.pixel[prefetched_ + 1]);
    prefetched_ = std::min(prefetched_ + 2, active_.count);
  }
  // Without a branch: active pixels are as hard to predict as events.
  std::size_t count = 0, vector = 0;
  for (int x = begin; x < end; x += lanes) {
    const ChosenLanes<D> chosen(moved_.leaving[vector++]);
    chosen.store_positions(static_cast<std::uint32_t>(x), moved_.columns.data() + count);
    count += chosen.count();
  }
  return {moved_.columns.data(), count};
}

/// Adds the pixels of these columns to the active pixels.
template <int kOrder>
void PixelUpdate::activate(const FilterRow& row, int begin, std::span<const std::uint32_t> columns) {
  ActivePixels& a = active_;
  std::size_t to = a.count;
  for (const std::uint32_t x : columns) {
    const std::size_t at = x - static_cast<std::uint32_t>(begin);
    a.pixel[to] = row.pixel + x;
    a.place[to] = row.place + 2 * x;
    a.light0[to] = row.light0[x], a.light1[to] = row.light1[x];
    a.start[to] = row.start[x], a.end[to] = row.end[x];
    if constexpr (kOrder > 0) {
      a.phase[to] = moved_.phase[at], a.moved[to] = moved_.moved[at];
      a.filtered1[to] = row.filtered1[x];
    }
    if constexpr (kOrder == 2) a.filtered2[to] = row.filtered2[x];
    ++to;
  }
  a.count = to;
}

/// Advances the active pixels through the segment: all of them, or only until there is room for more.
template <int kOrder>
void PixelUpdate::run_active(PixelArray& pixels, const Segment& segment, bool all, PackedEvents& events) {
  const auto duration = static_cast<double>(segment.t1 - segment.t0);
  const auto run = [&](auto& pass, const auto& take) {
    for (; prefetched_ < active_.count; ++prefetched_) pixels.prefetch(active_.pixel[prefetched_]);
    take(pass.signals, pass.take(pixels, active_, segment.t0, segment.t1));
    do {
      pass.round(pixels, active_, events);
    } while (all ? active_.count > 0 : active_.count == kBlock);
    prefetched_ = active_.count;
  };
  if constexpr (kOrder == 0) {
    run(linear_, [&](LinearSignals& signals, std::size_t first) { signals.take(active_, first, duration); });
  } else {
    run(relaxing_,
        [&](RelaxingSignals& signals, std::size_t first) { signals.take(active_, first, kOrder, duration); });
  }
}

/// Brightness of a row's pixels at the segment's end: `given`, or from the irradiance. Null if that is invalid.
const float* PixelUpdate::brightness_row(const PixelArray& pixels, const Segment& segment, const Image<float>* given,
                                         int y) {
  if (given != nullptr) return all_irradiance(segment, {y, y + 1}) ? given->row(y) + segment.tile.x : nullptr;
  const auto length = static_cast<std::size_t>(segment.tile.width);
  float_row_.resize(length);
  const float* const irradiance = segment.irradiance1.row(y) + segment.tile.x;
  return respond(pixels.options, length, irradiance, float_row_.data()) ? float_row_.data() : nullptr;
}

template <int kOrder>
void PixelUpdate::filter_row(PixelArray& pixels, const Segment& segment, const Filter& filter, const float* brightness,
                             int y, PastSegment* past, PackedEvents& events) {
  const int left = segment.tile.x, width = segment.tile.width;
  const std::size_t first = index(pixels, left, y);
  const auto from = [&](auto& values) { return values.empty() ? nullptr : values.data() + first; };
  FilterRow row{.light0 = segment.irradiance0.row(y) + left,
                .light1 = segment.irradiance1.row(y) + left,
                .end = brightness,
                .start = from(pixels.brightness),
                .filtered1 = from(pixels.filtered1),
                .filtered2 = from(pixels.filtered2),
                .bound_low = from(pixels.bound_low),
                .bound_high = from(pixels.bound_high),
                .timers = from(pixels.timers),
                .pixel = static_cast<std::uint32_t>(first),
                .place = static_cast<std::uint32_t>(events.packing().place(left, y))};
  if (past != nullptr) row.keep_in(*past, y - segment.tile.y);
  const auto filter_to = [&](auto d, int begin, int end) {
    std::span<const std::uint32_t> columns = move<kOrder>(d, pixels, row, filter, begin, end);
    while (!columns.empty()) {
      const std::size_t room = std::min(kBlock - active_.count, columns.size());
      activate<kOrder>(row, begin, columns.first(room));
      columns = columns.subspan(room);
      if (active_.count == kBlock) run_active<kOrder>(pixels, segment, false, events);
    }
    const auto count = static_cast<std::size_t>(end - begin);
    row.keep_ends(begin, count);
    std::copy_n(row.end + begin, count, row.start + begin);
    if constexpr (kOrder > 0) std::copy_n(moved_.filtered1.data(), count, row.filtered1 + begin);
    if constexpr (kOrder == 2) std::copy_n(moved_.filtered2.data(), count, row.filtered2 + begin);
  };
  const hn::CappedTag<float, 8> whole;
  const int middle = width - width % static_cast<int>(hn::Lanes(whole));
  for (int begin = 0; begin < middle; begin += kMovedTogether) {
    filter_to(whole, begin, std::min(begin + kMovedTogether, middle));
  }
  if (middle < width) filter_to(hn::CappedTag<float, 1>(), middle, width);
}

/// If bounds are of brightness: advances all low-passes, and then through the segment the pixels whose filtered
/// brightness may leave its bounds.
bool PixelUpdate::filter(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows,
                         PastSegment* past, PackedEvents& events) {
  const Filter common(pixels, segment);
  const int order = pixels.effects.poles;
  for (int y = rows.first; y < rows.last; ++y) {
    if (y + 1 < rows.last) prefetch_row(segment, y + 1);
    const float* const row = brightness_row(pixels, segment, brightness, y);
    if (row == nullptr) return false;
    if (order == 0) filter_row<0>(pixels, segment, common, row, y, past, events);
    if (order == 1) filter_row<1>(pixels, segment, common, row, y, past, events);
    if (order == 2) filter_row<2>(pixels, segment, common, row, y, past, events);
  }
  if (order == 0) run_active<0>(pixels, segment, true, events);
  if (order == 1) run_active<1>(pixels, segment, true, events);
  if (order == 2) run_active<2>(pixels, segment, true, events);
  return true;
}

/// If bounds are of irradiance: advances the pixels that become active in the segment.
bool PixelUpdate::cross(PixelArray& pixels, const Segment& segment, Rows rows, PackedEvents& events) {
  if (!watch_.look(pixels, segment, rows)) return false;
  if (pixels.effects.clean) {
    clean_.run(pixels, segment, watch_, rows, events);
    return true;
  }
  const auto duration = static_cast<double>(segment.t1 - segment.t0);
  const auto run = [&](bool all) {
    const std::size_t first = linear_.take(pixels, active_, segment.t0, segment.t1);
    linear_.signals.take_light(active_, first, pixels.options.log_eps, duration);
    do {
      linear_.round(pixels, active_, events);
    } while (all ? active_.count > 0 : active_.count == kBlock);
  };
  for (int y = rows.first; y < rows.last; ++y) {
    for (const std::uint32_t x : watch_.columns(y)) {
      const std::size_t i = active_.count++;
      const int column = static_cast<int>(x);
      active_.pixel[i] = static_cast<std::uint32_t>(index(pixels, column, y));
      active_.place[i] = static_cast<std::uint32_t>(events.packing().place(column, y));
      active_.light0[i] = segment.irradiance0.row(y)[x];
      active_.light1[i] = segment.irradiance1.row(y)[x];
      if (active_.count == kBlock) run(false);
    }
  }
  run(true);
  return true;
}

bool PixelUpdate::advance(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows,
                          PastSegment* past, PackedEvents& events) {
  return pixels.effects.in_brightness ? filter(pixels, segment, brightness, rows, past, events)
                                      : cross(pixels, segment, rows, events);
}

/// Makes these pixels the active ones, with their state at the segment's start.
void PixelUpdate::gather(const PixelArray& pixels, const PastSegment& past, std::span<const std::uint32_t> which,
                         const EventPacking& packing) {
  const Segment& segment = past.segment;
  ActivePixels& a = active_;
  for (std::size_t i = 0; i < which.size(); ++i) {
    const int x = static_cast<int>(which[i]) % pixels.width, y = static_cast<int>(which[i]) / pixels.width;
    const auto at = [&](const Image<float>& image) {
      return image.empty() ? 0.0F : image(x - segment.tile.x, y - segment.tile.y);
    };
    a.pixel[i] = which[i];
    a.place[i] = static_cast<std::uint32_t>(packing.place(x, y));
    a.light0[i] = segment.irradiance0(x, y), a.light1[i] = segment.irradiance1(x, y);
    a.filtered1[i] = at(past.filtered1), a.filtered2[i] = at(past.filtered2);
    a.start[i] = at(past.start), a.end[i] = at(past.end);
  }
  a.count = prefetched_ = which.size();
  if (!pixels.effects.in_brightness || !past.start.empty()) return;
  respond(pixels.options, a.count, a.light0.data(), a.start.data());
  respond(pixels.options, a.count, a.light1.data(), a.end.data());
}

/// Computes how far the low-passes of the active pixels move in the segment.
void PixelUpdate::find_phases(const Filter& filter) {
  const hn::CappedTag<float, 8> d;
  for (std::size_t i = 0; i < active_.count; i += hn::Lanes(d)) {
    const auto light0 = hn::LoadU(d, active_.light0.data() + i), light1 = hn::LoadU(d, active_.light1.data() + i);
    const auto phase = filter.phase(d, light0, light1);
    hn::StoreU(phase, d, active_.phase.data() + i);
    hn::StoreU(moved_after(d, phase), d, active_.moved.data() + i);
  }
}

void PixelUpdate::resume(PixelArray& pixels, const PastSegment& past, std::span<const std::uint32_t> which,
                         PackedEvents& events) {
  const Segment& segment = past.segment;
  if (pixels.effects.clean) return clean_.resume(pixels, segment, which, events);
  const auto duration = static_cast<double>(segment.t1 - segment.t0);
  const int order = pixels.effects.poles;
  const Filter filter(pixels, segment);
  for (; !which.empty(); which = which.subspan(std::min(kBlock, which.size()))) {
    gather(pixels, past, which.first(std::min(kBlock, which.size())), events.packing());
    const auto run = [&](auto& pass, const auto& take) {
      take(pass.signals, pass.take(pixels, active_, segment.t0, segment.t1));
      pass.round(pixels, active_, events, true);
      active_.count = prefetched_ = 0;
    };
    if (order > 0) {
      find_phases(filter);
      run(relaxing_, [&](RelaxingSignals& signals, std::size_t i) { signals.take(active_, i, order, duration); });
    } else if (pixels.effects.in_brightness) {
      run(linear_, [&](LinearSignals& signals, std::size_t i) { signals.take(active_, i, duration); });
    } else {
      const double eps = pixels.options.log_eps;
      run(linear_, [&](LinearSignals& signals, std::size_t i) { signals.take_light(active_, i, eps, duration); });
    }
  }
}

void PixelUpdate::draw_again(PixelArray& pixels, std::span<const std::uint32_t> which) {
  if (pixels.effects.clean) return;
  for (; !which.empty(); which = which.subspan(std::min(kBlock, which.size()))) {
    active_.count = std::min(kBlock, which.size());
    std::copy_n(which.begin(), active_.count, active_.pixel.begin());
    linear_.draw_again(pixels, active_);
    active_.count = 0;
  }
}

bool PixelUpdate::open(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows) {
  if (!all_irradiance(segment, rows)) return false;
  const auto width = static_cast<std::size_t>(segment.tile.width);
  if (row_.size() < width + kVectorPadding) row_.resize(width + kVectorPadding, 1.0);
  for (int y = rows.first; y < rows.last; ++y) {
    const std::size_t first = index(pixels, segment.tile.x, y);
    if (pixels.effects.in_brightness) {
      const float* const row = brightness_row(pixels, segment, brightness, y);  // checked above
      std::copy_n(row, width, row_.data());
      for (auto* values : {&pixels.brightness, &pixels.filtered1, &pixels.filtered2}) {
        if (!values->empty()) std::copy_n(row, width, values->data() + first);
      }
    } else {
      const float* const row = segment.irradiance1.row(y) + segment.tile.x;
      for (std::size_t i = 0; i < width; ++i) row_[i] = row[i] + pixels.options.log_eps;
      logarithms(width, row_.data());
    }
    if (pixels.effects.clean) {
      clean_.open(pixels, static_cast<std::uint32_t>(first), {row_.data(), width});
      continue;
    }
    for (std::size_t begin = 0; begin < width; begin += kBlock) {
      const std::size_t count = std::min(kBlock, width - begin);
      for (std::size_t i = 0; i < count; ++i) active_.pixel[i] = static_cast<std::uint32_t>(first + begin + i);
      active_.count = count;
      linear_.take(pixels, active_, segment.t0, segment.t1);
      for (std::size_t i = 0; i < count; ++i) linear_.signals.set(i, row_[begin + i], row_[begin + i]);
      linear_.open(pixels, active_);
    }
  }
  return true;
}

}  // namespace esim::inline event_camera

#include "esim/sensors/clean_pass.h"

#include <algorithm>
#include <cmath>

#include "esim/sensors/vector_math.h"

namespace esim {

void CleanPass::make_room(std::size_t count) {
  if (pixel_.size() >= count + kVectorPadding) return;
  const std::size_t size = 2 * count + kVectorPadding;
  for (auto* values :
       {&before_, &after_, &on_, &off_, &reference_, &crossing_, &polarity_, &next_reference_, &resumes_})
    values->resize(size, 1.0);
  pixel_.resize(size), place_.resize(size);
  settled_.resize(size), low_.resize(size), high_.resize(size);
}

void CleanPass::run(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows,
                    PackedEvents& events) {
  gather(pixels, segment, watch, rows, *events.packing);
  logarithms(count_, before_.data());
  logarithms(count_, after_.data());
  if (pixels.holds) resume(pixels, segment);
  const double duration = static_cast<double>(segment.t1 - segment.t0);
  while (count_ > 0) {
    find_crossings(duration, pixels.holds ? static_cast<double>(pixels.refractory) : 0.0);
    report(pixels, segment.t0, duration, events);
  }
  set_bands(pixels);
}

void CleanPass::gather(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows,
                       const EventPacking& packing) {
  make_room(watch.count());
  const double eps = pixels.options.log_eps, on = pixels.threshold_on, off = pixels.threshold_off;
  std::size_t i = 0;
  for (int y = rows.first; y < rows.last; ++y) {
    const float *const light0 = segment.irradiance0->row(y), *const light1 = segment.irradiance1->row(y);
    const std::uint32_t row = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(pixels.width);
    const PixelArray::State* const states = pixels.states.data() + row;
    for (const std::uint32_t x : watch.columns(y)) {
      before_[i] = light0[x] + eps;
      after_[i] = light1[x] + eps;
      const PixelArray::State& state = states[x];
      reference_[i] = state.reference;
      on_[i] = on + state.on;
      off_[i] = off + state.off;
      pixel_[i] = row + x;
      place_[i] = packing.place(static_cast<int>(x), y);
      ++i;
    }
  }
  count_ = i;
}

void CleanPass::move(std::size_t from, std::size_t to) {
  before_[to] = before_[from], after_[to] = after_[from];
  on_[to] = on_[from], off_[to] = off_[from];
  pixel_[to] = pixel_[from], place_[to] = place_[from];
}

/// Ends the refractory periods that end in this segment. Pixels that stay in reset are dropped.
void CleanPass::resume(PixelArray& pixels, const Segment& segment) {
  const double per_ns = 1.0 / static_cast<double>(segment.t1 - segment.t0);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    double reference = reference_[i];
    if (reference == kHeld) [[unlikely]] {
      const TimeNs until = pixels.until[pixel_[i]];
      if (until > segment.t1) continue;
      reference = before_[i] + (after_[i] - before_[i]) * static_cast<double>(until - segment.t0) * per_ns;
    }
    if (kept != i) [[unlikely]]
      move(i, kept);
    reference_[kept++] = reference;
  }
  count_ = kept;
}

/// When each pixel passes its next level, if it does, and its reference behind that.
void CleanPass::find_crossings(double duration, double refractory) {
  const std::size_t count = count_;
  const double *const before = before_.data(), *const after = after_.data(), *const reference = reference_.data();
  const double *const on = on_.data(), *const off = off_.data();
  double *const crossing = crossing_.data(), *const polarity = polarity_.data();
  double *const next_reference = next_reference_.data(), *const resumes = resumes_.data();
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double start = before[i], end = after[i], rise = end - start;
    const double high = reference[i] + on[i], low = reference[i] - off[i];
    const bool up = end >= high, down = end <= low;
    const double level = up ? high : low;
    const double share = (level - start) / rise;
    double t = std::floor(share * duration + 0.5);
    t = t > 1.0 ? t : 1.0;
    t = t < duration ? t : duration;
    crossing[i] = t;
    polarity[i] = up ? 1.0 : (down ? -1.0 : 0.0);
    const double until = t + refractory;
    resumes[i] = until;
    next_reference[i] = refractory > 0 ? start + rise * (until / duration) : level;
  }
}

/// Packs the events that were found, and settles the pixels without one. Those that may have another remain.
void CleanPass::report(PixelArray& pixels, TimeNs t0, double duration, PackedEvents& events) {
  std::vector<std::uint64_t>& out = *events.events;
  const std::size_t first = out.size();
  out.resize(first + count_);
  std::uint64_t* next = out.data() + first;
  const EventPacking packing = *events.packing;
  const TimeNs start = t0 - packing.origin;
  std::size_t kept = 0, settled = settled_count_;
  for (std::size_t i = 0; i < count_; ++i) {
    const bool fired = polarity_[i] != 0;
    const std::uint32_t pixel = pixel_[i];
    *next = packing.pack(start + static_cast<TimeNs>(crossing_[i]), place_[i], polarity_[i] > 0);
    next += fired;
    const double reference = reference_[i];
    settled_[settled] = pixel;
    low_[settled] = static_cast<float>(reference - off_[i]);
    high_[settled] = static_cast<float>(reference + on_[i]);
    settled += !fired;
    pixels.states[pixel].reference = reference;
    if (pixels.holds && fired && resumes_[i] > duration) [[unlikely]] {
      pixels.until[pixel] = t0 + static_cast<TimeNs>(resumes_[i]);
      pixels.states[pixel].reference = kHeld;
      pixels.empty_band(pixel);
      continue;
    }
    move(i, kept);
    reference_[kept] = next_reference_[i];
    kept += fired;
  }
  out.resize(static_cast<std::size_t>(next - out.data()));
  count_ = kept;
  settled_count_ = settled;
}

/// Gives the settled pixels their bands.
void CleanPass::set_bands(PixelArray& pixels) {
  pixels.set_bands(settled_count_, settled_.data(), low_.data(), high_.data());
  settled_count_ = 0;
}

}  // namespace esim

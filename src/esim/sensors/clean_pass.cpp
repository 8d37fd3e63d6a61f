#include "esim/sensors/clean_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "esim/sensors/vector_math.h"

namespace esim {
namespace {

constexpr std::size_t kBlock = 256;  // pixels

template <typename T>
using PerPixel = std::array<T, kBlock + kVectorPadding>;

}  // namespace

/// Some pixels that are awake. Brightness is at the segment's ends; times are ns after its start.
struct CleanPass::Block {
  PerPixel<double> before, after, on, off, reference;
  PerPixel<double> crossing, polarity, next_reference, resumes;
  PerPixel<std::uint64_t> place;
  PerPixel<std::uint32_t> pixel;
  std::size_t count = 0;

  // Those that are done: the levels that they sleep between.
  PerPixel<std::uint32_t> settled;
  PerPixel<float> low, high;
  std::size_t settled_count = 0;

  Block() { before.fill(1), after.fill(1), low.fill(0), high.fill(0); }

  void gather(const PixelArray& pixels, const Segment& segment, const EventPacking& packing, int y,
              std::span<const std::uint32_t> columns);
  void resume(const PixelArray& pixels, const Segment& segment);
  void find_crossings(double duration, double refractory);
  void report(PixelArray& pixels, TimeNs t0, double duration, PackedEvents& events);
  void keep(std::size_t from, std::size_t to, double new_reference) {
    before[to] = before[from], after[to] = after[from];
    on[to] = on[from], off[to] = off[from];
    place[to] = place[from], pixel[to] = pixel[from];
    reference[to] = new_reference;
  }
};

CleanPass::CleanPass() : block_(std::make_unique<Block>()) {}
CleanPass::~CleanPass() = default;
CleanPass::CleanPass(CleanPass&&) noexcept = default;
CleanPass& CleanPass::operator=(CleanPass&&) noexcept = default;

void CleanPass::Block::gather(const PixelArray& pixels, const Segment& segment, const EventPacking& packing, int y,
                              std::span<const std::uint32_t> columns) {
  const double eps = pixels.options.log_eps, threshold_on = pixels.threshold_on, threshold_off = pixels.threshold_off;
  const float *const light0 = segment.irradiance0->row(y), *const light1 = segment.irradiance1->row(y);
  const std::uint32_t row = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(pixels.width);
  const PixelArray::State* const states = pixels.states.data() + row;
  std::size_t i = count;
  for (const std::uint32_t x : columns) {
    before[i] = light0[x] + eps;
    after[i] = light1[x] + eps;
    const PixelArray::State state = states[x];
    reference[i] = state.reference;
    on[i] = threshold_on + state.on;
    off[i] = threshold_off + state.off;
    pixel[i] = row + x;
    place[i] = packing.place(static_cast<int>(x), y);
    ++i;
  }
  count = i;
}

/// Ends the refractory periods that end in this segment. Pixels that stay in reset are dropped.
void CleanPass::Block::resume(const PixelArray& pixels, const Segment& segment) {
  const double per_ns = 1.0 / static_cast<double>(segment.t1 - segment.t0);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    double level = reference[i];
    if (level == kHeld) [[unlikely]] {
      const TimeNs until = pixels.until[pixel[i]];
      if (until > segment.t1) continue;
      level = before[i] + (after[i] - before[i]) * static_cast<double>(until - segment.t0) * per_ns;
      reference[i] = level;
    }
    if (kept != i) [[unlikely]]
      keep(i, kept, level);
    ++kept;
  }
  count = kept;
}

/// When each pixel passes its next level, if it does, and its reference behind that.
void CleanPass::Block::find_crossings(double duration, double refractory) {
  const double per_duration = 1 / duration;
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double start = before[i], end = after[i], rise = end - start;
    const double upper = reference[i] + on[i], lower = reference[i] - off[i];
    const bool up = end >= upper, down = end <= lower;
    const double level = up ? upper : lower;
    double t = std::floor((level - start) / rise * duration + 0.5);
    t = t > 1.0 ? t : 1.0;
    t = t < duration ? t : duration;
    crossing[i] = t;
    polarity[i] = up ? 1.0 : (down ? -1.0 : 0.0);
    const double until = t + refractory;
    resumes[i] = until;
    next_reference[i] = refractory > 0 ? start + rise * (until * per_duration) : level;
  }
}

/// Packs the events that were found, and settles the pixels without one. Those that may have another remain.
void CleanPass::Block::report(PixelArray& pixels, TimeNs t0, double duration, PackedEvents& events) {
  std::vector<std::uint64_t>& out = *events.events;
  const std::size_t first = out.size();
  out.resize(first + count);
  std::uint64_t* next = out.data() + first;
  const EventPacking packing = *events.packing;
  const TimeNs start = t0 - packing.origin;
  PixelArray::State* const states = pixels.states.data();
  const bool holds = pixels.holds;
  std::size_t kept = 0, done = settled_count;
  for (std::size_t i = 0; i < count; ++i) {
    const bool fired = polarity[i] != 0;
    *next = packing.pack(start + static_cast<TimeNs>(crossing[i]), place[i], polarity[i] > 0);
    next += fired;
    const double level = reference[i];
    settled[done] = pixel[i];
    low[done] = static_cast<float>(level - off[i]);
    high[done] = static_cast<float>(level + on[i]);
    done += !fired;
    states[pixel[i]].reference = level;
    if (holds && fired && resumes[i] > duration) [[unlikely]] {
      pixels.until[pixel[i]] = t0 + static_cast<TimeNs>(resumes[i]);
      states[pixel[i]].reference = kHeld;
      pixels.empty_band(pixel[i]);
      continue;
    }
    keep(i, kept, next_reference[i]);
    kept += fired;
  }
  out.resize(static_cast<std::size_t>(next - out.data()));
  count = kept;
  settled_count = done;
}

void CleanPass::run_block(PixelArray& pixels, const Segment& segment, PackedEvents& events) {
  Block& block = *block_;
  logarithms(block.count, block.before.data());
  logarithms(block.count, block.after.data());
  if (pixels.holds) block.resume(pixels, segment);
  const double duration = static_cast<double>(segment.t1 - segment.t0);
  while (block.count > 0) {
    block.find_crossings(duration, pixels.holds ? static_cast<double>(pixels.refractory) : 0.0);
    block.report(pixels, segment.t0, duration, events);
  }
  pixels.set_bands(block.settled_count, block.settled.data(), block.low.data(), block.high.data());
  block.settled_count = 0;
}

void CleanPass::run(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows,
                    PackedEvents& events) {
  for (int y = rows.first; y < rows.last; ++y) {
    std::span<const std::uint32_t> columns = watch.columns(y);
    while (!columns.empty()) {
      const std::size_t room = std::min(kBlock - block_->count, columns.size());
      block_->gather(pixels, segment, *events.packing, y, columns.first(room));
      columns = columns.subspan(room);
      if (block_->count == kBlock) run_block(pixels, segment, events);
    }
  }
  run_block(pixels, segment, events);
}

}  // namespace esim

#include "esim/event_camera/pixel/clean_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "esim/core/vector_math.h"
#include "esim/event_camera/pixel/pixel_block.h"

namespace esim::inline event_camera {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Pixels that advance through a segment. Brightness is at the segment's ends; times are in ns after its start.
struct Lanes {
  PerPixel<double> before, after, on, off, reference;
  PerPixel<double> polarity;  // of the last round: 1, -1, or 0 without an event
  PerPixel<double> crossing;  // time of the event
  PerPixel<double> resumes;   // end of the refractory period after it
  PerPixel<double> again;     // 1 if it also fires in the next round
  PerPixel<std::uint32_t> place;
  std::size_t count = 0;

  Lanes() { before.fill(1), after.fill(1); }

  /// One round: each pixel that crosses its next level fires once. Its new reference is the level, or, if it is held in
  /// reset (refractory >= 0), the brightness at the end of the refractory period. Returns when the last refractory
  /// period ends.
  double fire(double duration, double refractory) {
    const double per_duration = 1 / duration;
    double last = 0;
#pragma omp simd reduction(max : last)
    for (std::size_t i = 0; i < count; ++i) {
      const double start = before[i], end = after[i], rise = end - start, level = reference[i];
      const double upper = level + on[i], lower = level - off[i];
      const bool up = end >= upper, down = end <= lower;
      const double passed = up ? upper : lower;
      double t = std::floor((passed - start) / rise * duration + 0.5);
      t = t > 1.0 ? t : 1.0;
      t = t < duration ? t : duration;
      const double until = t + refractory;
      const double next = refractory >= 0 ? start + rise * (until * per_duration) : passed;
      crossing[i] = t;
      resumes[i] = until;
      polarity[i] = up ? 1.0 : (down ? -1.0 : 0.0);
      const double ends = up || down ? until : 0.0;
      last = last > ends ? last : ends;
      const double now = up || down ? next : level;
      reference[i] = now;
      again[i] = end >= now + on[i] || end <= now - off[i] ? 1.0 : 0.0;
    }
    return last;
  }

  /// Makes a pixel fire no more events in this segment.
  void silence(std::size_t i) {
    on[i] = off[i] = kInfinity;
    again[i] = 0;
  }

  void copy(const Lanes& from, std::size_t i, std::size_t to) {
    before[to] = from.before[i], after[to] = from.after[i];
    on[to] = from.on[i], off[to] = from.off[i];
    reference[to] = from.reference[i], place[to] = from.place[i];
  }
};

}  // namespace

struct CleanPass::Block {
  Lanes all;
  PerPixel<std::uint32_t> pixel;
  bool some_held = false;  // among the gathered pixels

  // The few pixels that fire more than once, and their indices.
  Lanes rest;
  PerPixel<std::uint32_t> origin;

  PerPixel<float> low, high;  // bounds while inactive
  PerPixel<std::uint32_t> chosen;

  Block() { low.fill(0), high.fill(0); }

  /// The indices below `count` for which predicate(i) is true. Without branches: the pixels that fire are hard to
  /// predict.
  template <typename Predicate>
  std::span<const std::uint32_t> choose(std::size_t count, const Predicate& predicate) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < count; ++i) {
      chosen[found] = static_cast<std::uint32_t>(i);
      found += predicate(i) ? 1 : 0;
    }
    return {chosen.data(), found};
  }

  void gather(const PixelArray& pixels, const Segment& segment, const EventPacking& packing, int y,
              std::span<const std::uint32_t> columns);
  void wait(PixelArray& pixels);
  void resume(const PixelArray& pixels, const Segment& segment);
  void hold(PixelArray& pixels, Lanes& lanes, const std::uint32_t* which, TimeNs t0, double duration);
  void label(const Lanes& lanes, const std::uint32_t* which, TimeNs t0, std::vector<NewLabel>& labels) const;
  std::size_t take_rest();
  void settle(PixelArray& pixels);
};

CleanPass::CleanPass() : block_(std::make_unique<Block>()) {}
CleanPass::~CleanPass() = default;
CleanPass::CleanPass(CleanPass&&) noexcept = default;
CleanPass& CleanPass::operator=(CleanPass&&) noexcept = default;

void CleanPass::Block::gather(const PixelArray& pixels, const Segment& segment, const EventPacking& packing, int y,
                              std::span<const std::uint32_t> columns) {
  const double eps = pixels.options.log_eps, threshold_on = pixels.threshold_on, threshold_off = pixels.threshold_off;
  const float *const light0 = segment.irradiance0.row(y), *const light1 = segment.irradiance1.row(y);
  const std::uint32_t row = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(pixels.width);
  const PixelArray::CleanPixel* const states = pixels.clean_pixels.data() + row;
  std::size_t i = all.count;
  bool held = some_held;
  for (const std::uint32_t x : columns) {
    const PixelArray::CleanPixel state = states[x];
    all.before[i] = light0[x] + eps;
    all.after[i] = light1[x] + eps;
    all.reference[i] = state.reference;
    all.on[i] = threshold_on + state.on;
    all.off[i] = threshold_off + state.off;
    all.place[i] = static_cast<std::uint32_t>(packing.place(static_cast<int>(x), y));
    pixel[i] = row + x;
    held |= state.reference == kHeld;
    ++i;
  }
  all.count = i;
  some_held = held;
}

/// Ends the refractory periods that end in this segment, and excludes the pixels that stay in reset.
void CleanPass::Block::resume(const PixelArray& pixels, const Segment& segment) {
  const double per_ns = 1.0 / static_cast<double>(segment.t1 - segment.t0);
  for (const std::uint32_t i : choose(all.count, [&](std::size_t k) { return all.reference[k] == kHeld; })) {
    const TimeNs until = pixels.until[pixel[i]];
    if (until > segment.t1) {
      all.silence(i);
    } else {
      const double rise = all.after[i] - all.before[i];
      all.reference[i] = all.before[i] + rise * static_cast<double>(until - segment.t0) * per_ns;
    }
  }
}

/// Holds in reset the pixels that fired and whose refractory period ends after the segment. `which` are the indices of
/// `lanes` among all pixels; null: `lanes` are all pixels.
void CleanPass::Block::hold(PixelArray& pixels, Lanes& lanes, const std::uint32_t* which, TimeNs t0, double duration) {
  const auto stays_held = [&](std::size_t i) { return (lanes.resumes[i] > duration) & (lanes.polarity[i] != 0); };
  for (const std::uint32_t i : choose(lanes.count, stays_held)) {
    const std::size_t index = which != nullptr ? which[i] : i;
    pixels.until[pixel[index]] = t0 + static_cast<TimeNs>(lanes.resumes[i]);
    lanes.silence(i);
    lanes.reference[i] = all.reference[index] = kHeld;
    all.silence(index);
  }
}

/// (15) The labels of the pixels that fired: the signal alone makes events. `which` as in hold().
void CleanPass::Block::label(const Lanes& lanes, const std::uint32_t* which, TimeNs t0,
                             std::vector<NewLabel>& labels) const {
  for (std::size_t i = 0; i < lanes.count; ++i) {
    if (lanes.polarity[i] == 0) continue;
    const TimeNs t = t0 + static_cast<TimeNs>(lanes.crossing[i]);
    const double signal = lanes.polarity[i] > 0 ? lanes.on[i] : -lanes.off[i];
    labels.push_back({t,
                      t,
                      pixel[which != nullptr ? which[i] : i],
                      static_cast<float>(signal),
                      0,
                      0,
                      static_cast<std::int8_t>(lanes.polarity[i]),
                      0,
                      {}});
  }
}

/// Holds the pixels that fired in reset until they are released.
void CleanPass::Block::wait(PixelArray& pixels) {
  for (std::size_t i = 0; i < all.count; ++i) {
    if (all.polarity[i] == 0) continue;
    pixels.until[pixel[i]] = kFarAhead;
    all.reference[i] = kHeld;
  }
}

/// Copies the pixels that fire again to `rest`.
std::size_t CleanPass::Block::take_rest() {
  std::size_t count = 0;
  for (const std::uint32_t i : choose(all.count, [&](std::size_t k) { return all.again[k] != 0; })) {
    rest.copy(all, i, count);
    origin[count++] = i;
  }
  rest.count = count;
  return count;
}

/// Sets the references and bounds of all pixels.
void CleanPass::Block::settle(PixelArray& pixels) {
  for (std::size_t i = 0; i < all.count; ++i) {
    low[i] = static_cast<float>(all.reference[i] - all.off[i]);
    high[i] = static_cast<float>(all.reference[i] + all.on[i]);
  }
  PixelArray::CleanPixel* const states = pixels.clean_pixels.data();
  for (std::size_t i = 0; i < all.count; ++i) states[pixel[i]].reference = all.reference[i];
  pixels.set_bounds(all.count, pixel.data(), low.data(), high.data());
  if (pixels.effects.holds) {
    for (const std::uint32_t i : choose(all.count, [&](std::size_t k) { return all.reference[k] == kHeld; }))
      pixels.empty_bounds(pixel[i]);
  }
  all.count = 0;
  some_held = false;
}

void CleanPass::run_block(PixelArray& pixels, const Segment& segment, PackedEvents& events, bool wait) {
  Block& block = *block_;
  if (block.all.count == 0) return;
  logarithms(block.all.count, block.all.before.data());
  logarithms(block.all.count, block.all.after.data());
  if (block.some_held) block.resume(pixels, segment);

  const double duration = static_cast<double>(segment.t1 - segment.t0);
  const double refractory = pixels.effects.holds ? static_cast<double>(pixels.refractory) : -1.0;
  const auto round = [&](Lanes& lanes, const std::uint32_t* which) {
    const double last_reset = lanes.fire(duration, refractory);
    const double* const polarity = lanes.polarity.data();
    events.add(lanes.count, segment.t0, lanes.crossing.data(), lanes.place.data(), polarity, polarity);
    if (pixels.options.labels) block.label(lanes, which, segment.t0, events.labels);
    if (pixels.effects.holds && !wait && last_reset > duration) block.hold(pixels, lanes, which, segment.t0, duration);
  };
  // Most active pixels fire once; the others continue in a smaller group.
  round(block.all, nullptr);
  if (wait) {
    block.wait(pixels);
    return block.settle(pixels);
  }
  for (std::size_t left = block.take_rest(); left > 0;) {
    Lanes& rest = block.rest;
    round(rest, block.origin.data());
    left = 0;
    for (std::size_t i = 0; i < rest.count; ++i) {
      block.all.reference[block.origin[i]] = rest.reference[i];
      if (rest.again[i] == 0) continue;
      if (left != i) rest.copy(rest, i, left), block.origin[left] = block.origin[i];
      ++left;
    }
    rest.count = left;
  }
  block.settle(pixels);
}

void CleanPass::open(PixelArray& pixels, std::uint32_t first, std::span<const double> brightness) {
  Block& block = *block_;
  for (std::size_t begin = 0; begin < brightness.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, brightness.size() - begin);
    for (std::size_t i = 0; i < count; ++i) {
      block.pixel[i] = first + static_cast<std::uint32_t>(begin + i);
      const PixelArray::CleanPixel& state = pixels.clean_pixels[block.pixel[i]];
      block.all.reference[i] = brightness[begin + i];
      block.all.on[i] = pixels.threshold_on + state.on;
      block.all.off[i] = pixels.threshold_off + state.off;
    }
    block.all.count = count;
    block.settle(pixels);
  }
}

void CleanPass::resume(PixelArray& pixels, const Segment& segment, std::span<const std::uint32_t> which,
                       PackedEvents& events) {
  const auto width = static_cast<std::uint32_t>(pixels.width);
  for (const std::uint32_t index : which) {
    const std::uint32_t column = index % width;
    block_->gather(pixels, segment, events.packing(), static_cast<int>(index / width), {&column, 1});
    if (block_->all.count == kBlock) run_block(pixels, segment, events, true);
  }
  run_block(pixels, segment, events, true);
}

void CleanPass::run(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows,
                    PackedEvents& events) {
  for (int y = rows.first; y < rows.last; ++y) {
    std::span<const std::uint32_t> columns = watch.columns(y);
    while (!columns.empty()) {
      const std::size_t room = std::min(kBlock - block_->all.count, columns.size());
      block_->gather(pixels, segment, events.packing(), y, columns.first(room));
      columns = columns.subspan(room);
      if (block_->all.count == kBlock) run_block(pixels, segment, events);
    }
  }
  run_block(pixels, segment, events);
}

}  // namespace esim::inline event_camera

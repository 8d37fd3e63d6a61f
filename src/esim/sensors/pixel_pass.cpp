#include "esim/sensors/pixel_pass.h"

#include <algorithm>
#include <cmath>

#include "esim/sensors/vector_math.h"

namespace esim {

template <class Signal>
void PixelPass<Signal>::run(PixelArray& pixels, TimeNs t0, TimeNs t1, PackedEvents& events) {
  t0_ = t0, t1_ = t1;
  duration_ = static_cast<double>(t1 - t0);
  epoch_s_ = pixels.seconds_since_epoch(t0);
  make_room();
  if (pixels.renews) {
    run_in_rounds(pixels, events);
  } else if (pixels.alarmed || pixels.delays) {
    run_each<true>(pixels, events);
  } else {
    run_each<false>(pixels, events);
  }
  pixels.set_bands(settled_count_, settled_.data(), low_.data(), high_.data());
  settled_count_ = 0;
  count_ = 0;
}

template <class Signal>
void PixelPass<Signal>::settle_all(PixelArray& pixels, TimeNs t) {
  t1_ = t;
  make_room();
  for (std::size_t i = 0; i < count_; ++i) settle(pixels, awake_[i].pixel);
  pixels.set_bands(settled_count_, settled_.data(), low_.data(), high_.data());
  settled_count_ = 0;
  count_ = 0;
}

template <class Signal>
void PixelPass<Signal>::make_room() {
  if (settled_.size() >= count_ + kVectorPadding) return;
  settled_.resize(2 * count_ + kVectorPadding);
  low_.resize(settled_.size()), high_.resize(settled_.size());
}

/// One pixel after the other, each through all of its events.
template <class Signal>
template <bool kNoisy>
void PixelPass<Signal>::run_each(PixelArray& pixels, PackedEvents& events) {
  for (std::size_t i = 0; i < count_; ++i) {
    if (!begin(pixels, i)) continue;
    const AwakePixel awake = awake_[i];
    Signal signal = signals_[i];
    Next next;
    while (find<kNoisy>(pixels, awake, signal, next) && fire<kNoisy>(pixels, awake, signal, next, nullptr, events)) {
    }
  }
}

/// All pixels take one event at a time, so that their random numbers are computed together.
template <class Signal>
void PixelPass<Signal>::run_in_rounds(PixelArray& pixels, PackedEvents& events) {
  if (next_.size() < count_) next_.resize(awake_.size());
  const auto keep = [&](std::size_t from, std::size_t to) {
    if (from != to) awake_[to] = awake_[from], signals_[to] = signals_[from];
  };
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (begin(pixels, i)) keep(i, kept++);
  }
  for (count_ = kept; count_ > 0; count_ = kept) {
    kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (find<true>(pixels, awake_[i], signals_[i], next_[kept])) keep(i, kept++);
    }
    count_ = kept;
    renew(pixels);
    kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (fire<true>(pixels, awake_[i], signals_[i], next_[i], normals_.of(i), events)) keep(i, kept++);
    }
  }
}

/// Adds what leaks, and ends a refractory period that ends in this segment. False where the pixel stays in reset.
template <class Signal>
bool PixelPass<Signal>::begin(PixelArray& pixels, std::size_t i) {
  const std::uint32_t pixel = awake_[i].pixel;
  const bool was_held = pixels.holds && pixels.states[pixel].reference == kHeld;
  if (was_held && pixels.until[pixel] > t1_) return false;
  if (pixels.leaks) signals_[i].add(pixels.leak[pixel] * epoch_s_, pixels.leak[pixel] * 1e-9);
  if (was_held) {
    signals_[i].advance(static_cast<double>(pixels.until[pixel] - t0_));
    pixels.states[pixel].reference = signals_[i].value();
  }
  return true;
}

/// Finds the pixel's next event. A pixel that has none in this segment is settled.
template <class Signal>
template <bool kNoisy>
bool PixelPass<Signal>::find(PixelArray& pixels, const AwakePixel& awake, const Signal& signal, Next& next) {
  const double high = pixels.level_on(awake.pixel), low = pixels.level_off(awake.pixel);
  const Crossing crossing = signal.first_crossing(duration_, low, high);
  Crossing first = crossing;
  if (kNoisy && pixels.shoots) first = shot_before(pixels, awake, signal, crossing);
  if (first.tau != kNever) {
    next = {first.tau, first.on ? high : low, static_cast<std::int8_t>(first.on ? 1 : -1), first.tau < crossing.tau};
    return true;
  }
  settle(pixels, awake.pixel);
  return false;
}

/// Notes the levels that the pixel sleeps between, and sets its alarm.
template <class Signal>
void PixelPass<Signal>::settle(PixelArray& pixels, std::uint32_t pixel) {
  const PixelArray::Levels levels = pixels.sleep(pixel, t1_);
  settled_[settled_count_] = pixel;
  low_[settled_count_] = levels.low;
  high_[settled_count_++] = levels.high;
}

/// Shot noise is a Poisson process at its highest rate, thinned by the light of the moment: the first candidate before
/// the crossing that passes, or the crossing.
template <class Signal>
Crossing PixelPass<Signal>::shot_before(PixelArray& pixels, const AwakePixel& awake, const Signal& signal,
                                        Crossing crossing) const {
  while (pixels.shot_at[awake.pixel] <= t1_) {
    const double tau = static_cast<double>(pixels.shot_at[awake.pixel] - t0_);
    if (tau >= crossing.tau) break;
    constexpr double kToUnit = 0x1.0p-32;
    const auto bits = pixels.per_shot.bits(awake.pixel, pixels.shots[awake.pixel]++);
    pixels.next_shot(awake.pixel, (bits[0] + 0.5) * kToUnit);
    if (tau <= 0 || tau < signal.from()) continue;  // it fell into a refractory period
    const double light = awake.light0 + (awake.light1 - awake.light0) * tau / duration_;
    const double intensity = std::min(pixels.relative_intensity(light), 1.0);
    const double passes = 1.0 - (1.0 - pixels.options.shot_noise_at_white) * intensity;
    if (bits[1] * kToUnit < passes) return {tau, (bits[2] & 1U) != 0};
  }
  return crossing;
}

/// Draws the thresholds and leaks after the events that were found.
template <class Signal>
void PixelPass<Signal>::renew(PixelArray& pixels) {
  if (firing_.size() < count_) firing_.resize(awake_.size());
  for (std::size_t i = 0; i < count_; ++i) firing_[i] = awake_[i].pixel;
  normals_.draw(pixels.per_event, std::span(firing_).first(count_), pixels.draws);
  for (std::size_t i = 0; i < count_; ++i) {
    const double before = pixels.leaks ? pixels.leak[firing_[i]] : 0;
    pixels.renew(firing_[i], normals_.of(i));
    if (!pixels.leaks) continue;
    // From this event on, so that the signal stands where it stood.
    const double change = pixels.leak[firing_[i]] - before;
    signals_[i].add(change * epoch_s_, change * 1e-9);
    next_[i].level += change * (epoch_s_ + next_[i].tau * 1e-9);
  }
}

template <class Signal>
TimeNs PixelPass<Signal>::delay(const PixelArray& pixels, const AwakePixel& awake, double tau,
                                const float* normals) const {
  const EventCameraOptions& o = pixels.options;
  double ns = o.latency_us * 1e3;
  if (o.latency_jitter_us > 0) ns += o.latency_jitter_us * 1e3 * normals[3];
  if (o.latency_light_share > 0) {
    const double light = awake.light0 + (awake.light1 - awake.light0) * tau / duration_;
    ns *= 1.0 - o.latency_light_share + o.latency_light_share / pixels.relative_intensity(light);
  }
  return static_cast<TimeNs>(std::max(ns, 0.0) + 0.5);
}

/// Reports the event that was found, and sets the reference behind it. False where the pixel is then held in reset
/// until after the segment.
template <class Signal>
template <bool kNoisy>
bool PixelPass<Signal>::fire(PixelArray& pixels, const AwakePixel& awake, Signal& signal, const Next& next,
                             const float* normals, PackedEvents& events) const {
  const TimeNs t = std::clamp<TimeNs>(t0_ + static_cast<TimeNs>(next.tau + 0.5), t0_ + 1, t1_);
  const bool dropped = pixels.refractory > 0 && !pixels.holds && t < pixels.until[awake.pixel];
  if (!dropped) {
    const TimeNs stamp = kNoisy && pixels.delays ? t + delay(pixels, awake, next.tau, normals) : t;
    events.add(stamp, awake.x, awake.y, next.polarity > 0);
  }
  double& reference = pixels.states[awake.pixel].reference;
  if (pixels.holds) {
    const TimeNs until = t + pixels.refractory;
    if (until > t1_) {
      reference = kHeld;
      pixels.until[awake.pixel] = until;
      pixels.empty_band(awake.pixel);
      return false;
    }
    signal.advance(static_cast<double>(until - t0_));
    reference = signal.value();
    return true;
  }
  if (pixels.refractory > 0 && !dropped) pixels.until[awake.pixel] = t + pixels.refractory;
  signal.advance(next.tau);
  reference = kNoisy && next.noise ? signal.value() : next.level;
  return true;
}

template class PixelPass<LinearSignal>;
template class PixelPass<RelaxingSignal>;

}  // namespace esim

#include "esim/sensors/pixel_pass.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "esim/sensors/vector_math.h"

namespace esim {

template <class Signal>
void PixelPass<Signal>::reserve(std::size_t more) {
  if (awake_.size() >= count_ + more) return;
  const std::size_t size = 2 * (count_ + more);
  awake_.resize(size), signals_.resize(size), next_.resize(size);
  level_low_.resize(size), level_high_.resize(size), from_.resize(size), crossings_.resize(size);
  firing_.resize(size), settled_.resize(size);
  low_.resize(size + kVectorPadding), high_.resize(size + kVectorPadding);
}

template <class Signal>
void PixelPass<Signal>::keep(std::size_t from, std::size_t to) {
  if (from == to) return;
  awake_[to] = awake_[from];
  signals_[to] = signals_[from];
}

template <class Signal>
void PixelPass<Signal>::run(PixelArray& pixels, TimeNs t0, TimeNs t1, PackedEvents& events) {
  t0_ = t0, t1_ = t1;
  duration_ = static_cast<double>(t1 - t0);
  epoch_s_ = pixels.seconds_since_epoch(t0);
  begin(pixels);
  while (count_ > 0) {
    find(pixels);
    if (pixels.renews) renew(pixels);
    fire(pixels, events);
    resume(pixels);
  }
  set_bands(pixels);
}

/// Adds what leaks, and ends the refractory periods that end in this segment. Pixels that stay in reset are dropped.
template <class Signal>
void PixelPass<Signal>::begin(PixelArray& pixels) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::uint32_t pixel = awake_[i].pixel;
    const bool was_held = pixels.holds && pixels.states[pixel].reference == kHeld;
    if (was_held && pixels.until[pixel] > t1_) continue;
    if (pixels.leaks) signals_[i].add(pixels.leak(pixel) * epoch_s_, pixels.leak(pixel) * 1e-9);
    if (was_held) {
      signals_[i].advance(static_cast<double>(pixels.until[pixel] - t0_));
      pixels.states[pixel].reference = signals_[i].value();
    }
    keep(i, kept++);
  }
  count_ = kept;
}

/// Finds each pixel's next event. Pixels that have none in this segment are settled.
template <class Signal>
void PixelPass<Signal>::find(PixelArray& pixels) {
  for (std::size_t i = 0; i < count_; ++i) {
    level_low_[i] = pixels.level_off(awake_[i].pixel);
    level_high_[i] = pixels.level_on(awake_[i].pixel);
  }
  Signal::first_crossings(std::span(signals_).first(count_), duration_, level_low_.data(), level_high_.data(),
                          crossings_.data());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Crossing first = pixels.shoots ? shot_before(pixels, i, crossings_[i]) : crossings_[i];
    if (first.tau == kNever) {
      settle(pixels, i);
      continue;
    }
    next_[kept] = {first.tau, first.on ? level_high_[i] : level_low_[i], static_cast<std::int8_t>(first.on ? 1 : -1),
                   first.tau < crossings_[i].tau};
    keep(i, kept++);
  }
  count_ = kept;
}

/// Shot noise is a Poisson process at its highest rate, thinned by the light of the moment: the first candidate before
/// the crossing that passes, or the crossing.
template <class Signal>
Crossing PixelPass<Signal>::shot_before(PixelArray& pixels, std::size_t i, Crossing crossing) const {
  const AwakePixel& awake = awake_[i];
  PixelArray::Noise& noise = pixels.noise[awake.pixel];
  while (noise.shot_at <= t1_) {
    const double tau = static_cast<double>(noise.shot_at - t0_);
    if (tau >= crossing.tau) break;
    constexpr double kToUnit = 0x1.0p-32;
    const auto bits = pixels.per_shot.bits(awake.pixel, noise.shots++);
    pixels.next_shot(awake.pixel, (bits[0] + 0.5) * kToUnit);
    if (tau <= 0 || tau < signals_[i].from()) continue;  // it fell into a refractory period
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
  for (std::size_t i = 0; i < count_; ++i) {
    firing_[i] = {awake_[i].pixel, pixels.noise[awake_[i].pixel].draws++};
  }
  normals_.draw(pixels.per_event, std::span(firing_).first(count_));
  for (std::size_t i = 0; i < count_; ++i) {
    const std::uint32_t pixel = awake_[i].pixel;
    const double before = pixels.leak(pixel);
    pixels.renew(pixel, normals_.of(i));
    if (!pixels.leaks) continue;
    // From this event on, so that the signal stands where it stood.
    const double change = pixels.leak(pixel) - before;
    signals_[i].add(change * epoch_s_, change * 1e-9);
    next_[i].reference += change * (epoch_s_ + next_[i].tau * 1e-9);
  }
}

template <class Signal>
TimeNs PixelPass<Signal>::delay(const PixelArray& pixels, std::size_t i) const {
  const EventCameraOptions& o = pixels.options;
  double ns = o.latency_us * 1e3;
  if (o.latency_jitter_us > 0) ns += o.latency_jitter_us * 1e3 * normals_.of(i)[3];
  if (o.latency_light_share > 0) {
    const AwakePixel& awake = awake_[i];
    const double light = awake.light0 + (awake.light1 - awake.light0) * next_[i].tau / duration_;
    ns *= 1.0 - o.latency_light_share + o.latency_light_share / pixels.relative_intensity(light);
  }
  constexpr double kLongestNs = 1e17;
  return static_cast<TimeNs>(std::clamp(ns, 0.0, kLongestNs) + 0.5);
}

/// Reports the events that were found. Pixels that are then held in reset until after the segment are dropped.
template <class Signal>
void PixelPass<Signal>::fire(PixelArray& pixels, PackedEvents& events) {
  const TimeNs refractory = pixels.refractory, longest_delay = events.packing->longest() / 4;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const AwakePixel& awake = awake_[i];
    const Next next = next_[i];
    const TimeNs t = std::clamp<TimeNs>(t0_ + static_cast<TimeNs>(next.tau + 0.5), t0_ + 1, t1_);
    const bool dropped = refractory > 0 && !pixels.holds && t < pixels.until[awake.pixel];
    if (!dropped) {
      const TimeNs stamp = pixels.delays ? t + std::min(delay(pixels, i), longest_delay) : t;
      events.add(stamp, awake.x, awake.y, next.polarity > 0);
    }
    if (refractory > 0 && !dropped) pixels.until[awake.pixel] = t + refractory;
    if (pixels.holds && t + refractory > t1_) {
      pixels.states[awake.pixel].reference = kHeld;
      pixels.empty_band(awake.pixel);
      continue;
    }
    next_[kept] = next;
    from_[kept] = pixels.holds ? static_cast<double>(t + refractory - t0_) : next.tau;
    keep(i, kept++);
  }
  count_ = kept;
}

/// Sets the references behind the events.
template <class Signal>
void PixelPass<Signal>::resume(PixelArray& pixels) {
  Signal::advance(std::span(signals_).first(count_), from_.data());
  for (std::size_t i = 0; i < count_; ++i) {
    const bool anew = pixels.holds || next_[i].noise;
    pixels.states[awake_[i].pixel].reference = anew ? signals_[i].value() : next_[i].reference;
  }
}

/// Notes the levels that the pixel sleeps between, and sets its alarm.
template <class Signal>
void PixelPass<Signal>::settle(PixelArray& pixels, std::size_t i) {
  const std::uint32_t pixel = awake_[i].pixel;
  double signal = 0;
  if (pixels.leaks) {
    signal = pixels.in_brightness ? pixels.filtered(pixel) + pixels.leak(pixel) * pixels.seconds_since_epoch(t1_)
                                  : signals_[i].value(duration_);
  }
  const PixelArray::Levels levels = pixels.sleep(pixel, t1_, signal);
  settled_[settled_count_] = pixel;
  low_[settled_count_] = levels.low;
  high_[settled_count_++] = levels.high;
}

template <class Signal>
void PixelPass<Signal>::set_bands(PixelArray& pixels) {
  pixels.set_bands(settled_count_, settled_.data(), low_.data(), high_.data());
  settled_count_ = 0;
  count_ = 0;
}

template <class Signal>
void PixelPass<Signal>::settle_all(PixelArray& pixels, TimeNs t) {
  t1_ = t;
  duration_ = 0;
  for (std::size_t i = 0; i < count_; ++i) settle(pixels, i);
  set_bands(pixels);
}

template class PixelPass<LinearSignal>;
template class PixelPass<RelaxingSignal>;

}  // namespace esim

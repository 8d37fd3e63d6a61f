#include "esim/event_camera/pixel/pixel_pass.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline event_camera {
namespace {

// Fraction of a threshold that may drift before the bounds are renewed.
constexpr double kDriftPerBounds = 0.05;

constexpr double kPerNs = 1e-9, kNsPerS = 1e9;

}  // namespace

template <class Signals>
std::size_t PixelPass<Signals>::take(const PixelArray& pixels, ActivePixels& active, TimeNs t0, TimeNs t1) {
  Comparators& compare = round_.compare;
  t0_ = t0;
  round_.duration = static_cast<double>(t1 - t0);
  epoch_ns_ = static_cast<double>(t0 - pixels.epoch);
  compare.threshold_on = pixels.threshold_on, compare.threshold_off = pixels.threshold_off;
  const double duration = round_.duration, epoch_ns = epoch_ns_, epoch_s = epoch_ns * kPerNs;
  const std::size_t first = compare.count;
  std::size_t count = first, held_count = 0;
  for (std::size_t from = first; from < active.count; ++from) {
    const PixelArray::NoisyPixel& state = pixels.noisy_pixels[active.pixel[from]];
    const double until = state.until - epoch_ns;
    const bool held = state.reference == kHeld;
    if (held & (until > duration)) [[unlikely]]
      continue;
    const std::size_t i = count++;
    if (i != from) active.copy(from, i);
    held_[held_count] = static_cast<std::uint32_t>(i);
    held_count += held ? 1 : 0;
    compare.reference[i] = state.reference - state.drift * epoch_s;
    compare.on[i] = state.on, compare.off[i] = state.off;
    compare.drift[i] = state.drift * kPerNs;
    compare.from[i] = 0;
    draws_[i] = state.draws;
    until_[i] = until;
    pixels.effects.each([&](const auto& effect) { effect.take(lanes_, i, state, epoch_ns); });
  }
  active.count = compare.count = count;
  held_count_ = held_count;
  if (!pixels.set_at.empty()) {
    for (std::size_t i = first; i < count; ++i) set_at_[i] = pixels.set_at[active.pixel[i]] - epoch_ns;
  }
  return first;
}

template <class Signals>
void PixelPass<Signals>::round(PixelArray& pixels, ActivePixels& active, PackedEvents& events, bool wait) {
  constexpr double kLongestNs = 1e17;
  Comparators& compare = round_.compare;
  round_.active = &active;
  round_.max_delay = std::min(kLongestNs, static_cast<double>(events.packing().longest() / 4));
  resume_held();
  signals.find(compare);
  std::fill_n(round_.restarts.begin(), compare.count, pixels.effects.holds ? 1.0 : 0.0);
  if (pixels.options.labels) std::fill_n(round_.own.begin(), compare.count, std::uint8_t{0});
  pixels.effects.each_active([&](const auto& effect) { effect.find(lanes_, round_); });
  for (std::size_t i = 0; i < compare.count; ++i) {
    round_.passed[i] = compare.polarity[i] > 0 ? compare.upper(i) : compare.lower(i);
  }
  if (pixels.options.labels) take_apart(pixels);
  if (pixels.effects.draws) renew(pixels);
  fire(pixels);
  if (pixels.options.labels) label(events);
  events.add(compare.count, t0_, round_.stamp.data(), active.place.data(), compare.polarity.data(), reports_.data());
  reset(pixels, wait);
  deactivate(pixels, active);
}

template <class Signals>
void PixelPass<Signals>::draw_again(PixelArray& pixels, const ActivePixels& active) {
  if (!pixels.effects.draws) return;
  Comparators& compare = round_.compare;
  const std::size_t count = active.count;
  for (std::size_t i = 0; i < count; ++i) {
    const PixelArray::NoisyPixel& state = pixels.noisy_pixels[active.pixel[i]];
    compare.on[i] = state.on, compare.off[i] = state.off;
    compare.drift[i] = state.drift * kPerNs;
    draws_[i] = state.draws - 1;
    pixels.effects.each([&](const auto& effect) { effect.take(lanes_, i, state, 0.0); });
  }
  std::fill_n(compare.polarity.begin(), count, 1.0);
  std::fill_n(compare.tau.begin(), count, 0.0);
  compare.threshold_on = pixels.threshold_on, compare.threshold_off = pixels.threshold_off;
  compare.count = count;
  round_.active = &active;
  renew(pixels);
  for (std::size_t i = 0; i < count; ++i) {
    PixelArray::NoisyPixel& state = pixels.noisy_pixels[active.pixel[i]];
    state.on = compare.on[i], state.off = compare.off[i];
    state.drift = static_cast<float>(compare.drift[i] * kNsPerS);
  }
  compare.count = 0;
}

/// Ends the refractory periods that end in this segment.
template <class Signals>
void PixelPass<Signals>::resume_held() {
  Comparators& compare = round_.compare;
  for (std::size_t k = 0; k < held_count_; ++k) {
    const std::size_t i = held_[k];
    compare.from[i] = set_at_[i] = until_[i];
    signals.advance(compare, i);
    compare.reference[i] = signals.value(i) + compare.drift[i] * until_[i];
  }
  held_count_ = 0;
}

/// (15) The parts of the change at the new events.
template <class Signals>
void PixelPass<Signals>::take_apart(const PixelArray& pixels) {
  Comparators& compare = round_.compare;
  const ThresholdNoise::Lanes& means = lanes_;
  const bool leaks = !pixels.set_at.empty();
  for (std::size_t i = 0; i < compare.count; ++i) {
    if (round_.own[i] == 0) [[likely]]
      continue;
    compare.from[i] = compare.tau[i];  // fire() sets it for all pixels that fire
    signals.advance(compare, i);
  }
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) {
    const bool on = compare.polarity[i] > 0;
    const double tau = compare.tau[i], drift = compare.drift[i];
    const double reached = on ? compare.threshold_on + static_cast<double>(compare.on[i])
                              : -(compare.threshold_off + static_cast<double>(compare.off[i]));
    const double nominal = on ? compare.threshold_on + static_cast<double>(means.mean_on[i])
                              : -(compare.threshold_off + static_cast<double>(means.mean_off[i]));
    const double leak = leaks ? drift * (tau - set_at_[i]) : 0.0;
    const double change = round_.own[i] != 0 ? signals.value(i) + drift * tau - compare.reference[i] : reached;
    signal_[i] = static_cast<float>(change - leak);
    noise_[i] = static_cast<float>(nominal - change);
    leak_[i] = static_cast<float>(leak);
  }
}

/// Adds the labels of the events that are reported.
template <class Signals>
void PixelPass<Signals>::label(PackedEvents& events) const {
  const Comparators& compare = round_.compare;
  for (std::size_t i = 0; i < compare.count; ++i) {
    if (reports_[i] == 0) continue;
    const double crossing = std::clamp(std::floor(compare.tau[i] + 0.5), 1.0, round_.duration);
    NewLabel& label = events.labels.emplace_back();
    label.t = t0_ + static_cast<TimeNs>(round_.stamp[i]);
    label.t_ideal = t0_ + static_cast<TimeNs>(crossing);
    label.pixel = round_.active->pixel[i];
    label.signal = signal_[i], label.noise = noise_[i], label.leak = leak_[i];
    label.polarity = static_cast<std::int8_t>(compare.polarity[i]);
    label.is_noise = round_.own[i];
  }
}

/// Draws the parameters after the new events.
template <class Signals>
void PixelPass<Signals>::renew(const PixelArray& pixels) {
  const Comparators& compare = round_.compare;
  round_.normals.draw(pixels.per_event, compare.count, round_.active->pixel, draws_);
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) draws_[i] += compare.polarity[i] != 0 ? 1U : 0U;
  pixels.effects.each_active([&](const auto& effect) { effect.renew(lanes_, round_); });
}

/// Computes the times of the events and of the refractory periods after them.
template <class Signals>
void PixelPass<Signals>::fire(const PixelArray& pixels) {
  Comparators& compare = round_.compare;
  const double duration = round_.duration, refractory = static_cast<double>(pixels.refractory);
  const bool drops = pixels.effects.drops, holds = pixels.effects.holds;
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) {
    double t = std::floor(compare.tau[i] + 0.5);
    t = t > 1.0 ? t : 1.0;
    t = t < duration ? t : duration;
    reports_[i] = (compare.polarity[i] != 0) & !(drops & (t < until_[i])) ? 1.0 : 0.0;
    round_.stamp[i] = t;
  }
  // An acknowledged request is raised at the time stamp, which includes the latency.
  const auto delay = [&] { pixels.effects.each_active([&](const auto& effect) { effect.delay(lanes_, round_); }); };
  const bool delays_first = pixels.effects.acknowledged && holds;
  if (delays_first) delay();
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) {
    until_[i] = reports_[i] != 0 ? round_.stamp[i] + refractory : until_[i];
    const double resumes = holds ? until_[i] : compare.tau[i];
    compare.from[i] = compare.polarity[i] != 0 ? resumes : compare.from[i];
  }
  if (!delays_first) delay();
}

/// Sets the references after the events, and finds the pixels that may fire again.
template <class Signals>
void PixelPass<Signals>::reset(const PixelArray& pixels, bool wait) {
  Comparators& compare = round_.compare;
  const double duration = round_.duration;
  const PixelEffects& effects = pixels.effects;
  signals.advance(compare);
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) {
    const double now = signals.value(i) + compare.drift[i] * compare.from[i];
    const double next = round_.restarts[i] != 0 ? now : round_.passed[i];
    compare.reference[i] = compare.polarity[i] != 0 ? next : compare.reference[i];
  }
  if (!pixels.set_at.empty()) {
    for (std::size_t i = 0; i < compare.count; ++i)
      set_at_[i] = compare.polarity[i] != 0 ? compare.from[i] : set_at_[i];
  }
  signals.look_ahead(compare, again_.data());
  const double held_beyond = wait ? -kNever : (pixels.effects.holds ? duration : kNever);
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) {
    const bool fired = compare.polarity[i] != 0, held = fired & (until_[i] > held_beyond);
    const bool may = (again_[i] != 0) | (effects.next(lanes_, i) <= duration);
    again_[i] = (fired & !held) & may ? 1.0 : 0.0;
    compare.reference[i] = held ? kHeld : compare.reference[i];
  }
  if (!wait) return;
  for (std::size_t i = 0; i < compare.count; ++i) {
    if (compare.polarity[i] != 0) until_[i] = kNeverNs;
  }
}

/// Makes the finished pixels inactive, and keeps the others.
template <class Signals>
void PixelPass<Signals>::deactivate(PixelArray& pixels, ActivePixels& active) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Comparators& compare = round_.compare;
  const double duration = round_.duration, since_epoch = epoch_ns_ + duration;
  const PixelEffects& effects = pixels.effects;
#pragma omp simd
  for (std::size_t i = 0; i < compare.count; ++i) {
    const double reference = compare.reference[i], drift = compare.drift[i];
    const double upper = compare.upper(i), lower = compare.lower(i), now = signals.end(i) + drift * duration;
    // The drift lowers both levels: use the upper level at the timer's end and the current lower level, an upper bound.
    const double allowed = kDriftPerBounds * (upper - reference), room = 0.5 * (upper - now);
    double valid = (allowed < room ? allowed : room) / drift;
    valid = drift > 0 && valid < kNeverNs ? valid : kNeverNs;
    const bool held = reference == kHeld;
    const double sinks = drift > 0 ? drift * (duration + valid) : 0.0;
    low_[i] = held ? kInfinity : static_cast<float>(lower - drift * duration);
    high_[i] = held ? -kInfinity : static_cast<float>(upper - sinks);
    const double next = effects.next(lanes_, i) - duration, timer = next < valid ? next : valid;
    timer_[i] = PixelArray::ticks_after_epoch(since_epoch + timer);
  }
  // Pixels that continue are also written back here: they become inactive later.
  for (std::size_t i = 0; i < compare.count; ++i) write_back(effects, pixels.noisy_pixels[active.pixel[i]], i);
  if (pixels.effects.timers) {
    for (std::size_t i = 0; i < compare.count; ++i) pixels.timers[active.pixel[i]] = timer_[i];
  }
  if (!pixels.set_at.empty()) {
    for (std::size_t i = 0; i < compare.count; ++i) pixels.set_at[active.pixel[i]] = epoch_ns_ + set_at_[i];
  }
  pixels.set_bounds(compare.count, active.pixel.data(), low_.data(), high_.data());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < compare.count; ++i) {
    if (again_[i] == 0) [[likely]]
      continue;
    if (i != kept) {
      keep(active, i, kept);
      effects.each([&](const auto& effect) { effect.keep(lanes_, i, kept); });
    }
    ++kept;
  }
  compare.count = active.count = kept;
}

template <class Signals>
void PixelPass<Signals>::keep(ActivePixels& active, std::size_t i, std::size_t to) {
  active.copy(i, to);
  round_.compare.copy(i, to);
  signals.copy(i, to);
  draws_[to] = draws_[i], until_[to] = until_[i], set_at_[to] = set_at_[i];
}

template <class Signals>
void PixelPass<Signals>::write_back(const PixelEffects& effects, PixelArray::NoisyPixel& state, std::size_t i) const {
  const Comparators& compare = round_.compare;
  const double drift = compare.drift[i];
  state.reference = compare.reference[i] + drift * epoch_ns_;
  state.on = compare.on[i], state.off = compare.off[i];
  state.drift = static_cast<float>(drift * kNsPerS);
  state.draws = draws_[i];
  state.until = epoch_ns_ + until_[i];
  effects.each([&](const auto& effect) { effect.store(lanes_, i, state, epoch_ns_); });
}

template <class Signals>
void PixelPass<Signals>::open(PixelArray& pixels, ActivePixels& active) {
  Comparators& compare = round_.compare;
  const std::size_t count = compare.count;
  round_.active = &active;
  std::fill_n(compare.polarity.begin(), count, 1.0);
  std::fill_n(compare.tau.begin(), count, 0.0);
  std::fill_n(again_.begin(), count, 0.0);
  if (pixels.effects.draws) renew(pixels);
  for (std::size_t i = 0; i < count; ++i) compare.reference[i] = signals.end(i);
  pixels.effects.each_active([&](const auto& effect) { effect.open(lanes_, round_); });
  for (std::size_t i = 0; i < count; ++i) {
    const double leaked = signals.end(i) - compare.reference[i], drift = compare.drift[i];
    set_at_[i] = drift > 0 ? -leaked / drift : 0.0;
  }
  deactivate(pixels, active);
}

template class PixelPass<LinearSignals>;
template class PixelPass<RelaxingSignals>;

}  // namespace esim::inline event_camera

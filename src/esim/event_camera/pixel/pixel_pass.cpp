#include "esim/event_camera/pixel/pixel_pass.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline event_camera {
namespace {

// Fraction of a threshold that may leak before the bounds are renewed.
constexpr double kLeakPerBand = 0.05;

// Minimum time between leak events of a pixel, as a fraction of the mean.
constexpr double kMinLeakInterval = 0.05;

constexpr double kPerNs = 1e-9, kNsPerS = 1e9;

}  // namespace

template <class Signals>
std::size_t PixelPass<Signals>::take(const PixelArray& pixels, ActivePixels& active, TimeNs t0, TimeNs t1) {
  t0_ = t0;
  duration_ = static_cast<double>(t1 - t0);
  epoch_ns_ = static_cast<double>(t0 - pixels.epoch);
  compare_.threshold_on = pixels.threshold_on, compare_.threshold_off = pixels.threshold_off;
  const double duration = duration_, epoch_ns = epoch_ns_, epoch_s = epoch_ns * kPerNs;
  const std::size_t first = compare_.count;
  std::size_t count = first, held_count = 0;
  for (std::size_t from = first; from < active.count; ++from) {
    const PixelArray::NoisyPixel& own = pixels.noisy_pixels[active.pixel[from]];
    const double until = own.until - epoch_ns;
    const bool held = own.reference == kHeld;
    if (held & (until > duration)) [[unlikely]]
      continue;
    const std::size_t i = count++;
    if (i != from) active.copy(from, i);
    held_[held_count] = static_cast<std::uint32_t>(i);
    held_count += held ? 1 : 0;
    compare_.reference[i] = own.reference - own.leak * epoch_s;
    compare_.on[i] = own.on, compare_.off[i] = own.off;
    compare_.leak[i] = own.leak * kPerNs;
    compare_.from[i] = 0;
    mean_on_[i] = own.mean_on, mean_off_[i] = own.mean_off, mean_leak_[i] = own.mean_leak;
    draws_[i] = own.draws, shots_[i] = own.shots;
    shot_[i] = own.shot_at - epoch_ns;
    until_[i] = until;
  }
  active.count = compare_.count = count;
  held_count_ = held_count;
  return first;
}

template <class Signals>
void PixelPass<Signals>::round(PixelArray& pixels, ActivePixels& active, PackedEvents& events, bool wait) {
  resume_held();
  signals.find(compare_);
  std::fill_n(anew_.begin(), compare_.count, pixels.holds ? 1.0 : 0.0);
  if (pixels.shoots) find_shots(pixels, active);
  for (std::size_t i = 0; i < compare_.count; ++i) {
    passed_[i] = compare_.polarity[i] > 0 ? compare_.upper(i) : compare_.lower(i);
  }
  if (pixels.renews) renew(pixels, active);
  fire(pixels, active, events.packing());
  events.add(compare_.count, t0_, stamp_.data(), active.place.data(), compare_.polarity.data(), reports_.data());
  reset(pixels, wait);
  deactivate(pixels, active);
}

template <class Signals>
void PixelPass<Signals>::draw_again(PixelArray& pixels, const ActivePixels& active) {
  if (!pixels.renews) return;
  const std::size_t count = active.count;
  for (std::size_t i = 0; i < count; ++i) {
    const PixelArray::NoisyPixel& own = pixels.noisy_pixels[active.pixel[i]];
    mean_on_[i] = own.mean_on, mean_off_[i] = own.mean_off, mean_leak_[i] = own.mean_leak;
    draws_[i] = own.draws - 1;
  }
  std::fill_n(compare_.polarity.begin(), count, 1.0);
  std::fill_n(compare_.tau.begin(), count, 0.0);
  compare_.threshold_on = pixels.threshold_on, compare_.threshold_off = pixels.threshold_off;
  compare_.count = count;
  renew(pixels, active);
  for (std::size_t i = 0; i < count; ++i) {
    PixelArray::NoisyPixel& own = pixels.noisy_pixels[active.pixel[i]];
    own.on = compare_.on[i], own.off = compare_.off[i];
    if (pixels.leaks) own.leak = static_cast<float>(compare_.leak[i] * kNsPerS);
  }
  compare_.count = 0;
}

/// Ends the refractory periods that end in this segment.
template <class Signals>
void PixelPass<Signals>::resume_held() {
  for (std::size_t k = 0; k < held_count_; ++k) {
    const std::size_t i = held_[k];
    compare_.from[i] = until_[i];
    signals.advance(compare_, i);
    compare_.reference[i] = signals.value(i) + compare_.leak[i] * until_[i];
  }
  held_count_ = 0;
}

/// Shot noise is a Poisson process at its maximum rate, thinned according to the current irradiance.
template <class Signals>
void PixelPass<Signals>::find_shots(const PixelArray& pixels, const ActivePixels& active) {
  for (std::size_t i = 0; i < compare_.count; ++i) {
    if (shot_[i] <= duration_) [[unlikely]]
      find_shot(pixels, active, i);
  }
}

/// The first accepted candidate before the crossing becomes the pixel's event.
template <class Signals>
void PixelPass<Signals>::find_shot(const PixelArray& pixels, const ActivePixels& active, std::size_t i) {
  constexpr double kToUnit = 0x1.0p-32;
  while (shot_[i] <= duration_ && !(compare_.polarity[i] != 0 && shot_[i] >= compare_.tau[i])) {
    const double tau = shot_[i];
    const auto bits = pixels.per_shot.bits(active.pixel[i], shots_[i]++);
    shot_[i] += pixels.shot_interval((bits[0] + 0.5) * kToUnit);
    if (tau <= 0 || tau < compare_.from[i]) continue;  // within a refractory period
    const double light = active.light0[i] + (active.light1[i] - active.light0[i]) * tau / duration_;
    const double intensity = std::min(pixels.relative_intensity(light), 1.0);
    const double passes = 1.0 - (1.0 - pixels.options.shot_noise_at_white) * intensity;
    if (bits[1] * kToUnit >= passes) continue;
    compare_.tau[i] = tau;
    compare_.polarity[i] = (bits[2] & 1U) != 0 ? 1.0 : -1.0;
    anew_[i] = 1;
    return;
  }
}

/// Draws the thresholds and leaks after the new events.
template <class Signals>
void PixelPass<Signals>::renew(const PixelArray& pixels, const ActivePixels& active) {
  normals_.draw(pixels.per_event, compare_.count, active.pixel, draws_);
  const double sigma = pixels.options.threshold_noise, jitter = pixels.options.leak_jitter;
  const double least_on = kMinContrastThreshold - pixels.threshold_on;
  const double least_off = kMinContrastThreshold - pixels.threshold_off;
  const auto &normal_on = normals_[0], &normal_off = normals_[1], &normal_leak = normals_[2];
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    const bool fired = compare_.polarity[i] != 0;
    const double on = mean_on_[i] + sigma * normal_on[i], off = mean_off_[i] + sigma * normal_off[i];
    compare_.on[i] = fired ? static_cast<float>(on > least_on ? on : least_on) : compare_.on[i];
    compare_.off[i] = fired ? static_cast<float>(off > least_off ? off : least_off) : compare_.off[i];
    draws_[i] += fired ? 1U : 0U;
  }
  if (!pixels.leaks) return;
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    const double interval = 1.0 + jitter * normal_leak[i];
    const auto rate = static_cast<float>(mean_leak_[i] / (interval > kMinLeakInterval ? interval : kMinLeakInterval));
    const double leak = compare_.polarity[i] != 0 ? rate * kPerNs : compare_.leak[i];
    // The new leak starts at this event, so that the signal is continuous.
    passed_[i] += (leak - compare_.leak[i]) * compare_.tau[i];
    compare_.leak[i] = leak;
  }
}

/// Computes the times of the events and of the refractory periods after them.
template <class Signals>
void PixelPass<Signals>::fire(const PixelArray& pixels, const ActivePixels& active, const EventPacking& packing) {
  const double duration = duration_, refractory = static_cast<double>(pixels.refractory);
  const bool drops = pixels.drops, holds = pixels.holds;
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    double t = std::floor(compare_.tau[i] + 0.5);
    t = t > 1.0 ? t : 1.0;
    t = t < duration ? t : duration;
    reports_[i] = (compare_.polarity[i] != 0) & !(drops & (t < until_[i])) ? 1.0 : 0.0;
    stamp_[i] = t;
  }
  // An acknowledged request is raised at the time stamp, which includes the latency.
  const bool delays_first = pixels.delays && pixels.acknowledged && holds;
  if (delays_first) delay(pixels, active, packing);
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    until_[i] = reports_[i] != 0 ? stamp_[i] + refractory : until_[i];
    const double resumes = holds ? until_[i] : compare_.tau[i];
    compare_.from[i] = compare_.polarity[i] != 0 ? resumes : compare_.from[i];
  }
  if (pixels.delays && !delays_first) delay(pixels, active, packing);
}

template <class Signals>
void PixelPass<Signals>::delay(const PixelArray& pixels, const ActivePixels& active, const EventPacking& packing) {
  constexpr double kLongestNs = 1e17;
  const EventCameraOptions& o = pixels.options;
  const double mean = o.latency_us * 1e3, jitter = o.latency_jitter_us * 1e3, share = o.latency_light_share;
  const double dark = o.dark_irradiance, per_duration = 1 / duration_;
  const double longest = std::min(kLongestNs, static_cast<double>(packing.longest() / 4));
  const PerPixel<float>& normal = normals_[3];
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    const double light = active.light0[i] + (active.light1[i] - active.light0[i]) * compare_.tau[i] * per_duration;
    const double slower = 1.0 - share + share * (1.0 + dark) / (light + dark);
    double ns = (mean + (jitter > 0 ? jitter * normal[i] : 0.0)) * (share > 0 ? slower : 1.0);
    ns = ns > 0 ? ns : 0.0;
    ns = ns < longest ? ns : longest;
    stamp_[i] += std::floor(ns + 0.5);
  }
}

/// Sets the references after the events, and finds the pixels that may fire again.
template <class Signals>
void PixelPass<Signals>::reset(const PixelArray& pixels, bool wait) {
  signals.advance(compare_);
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    const double now = signals.value(i) + compare_.leak[i] * compare_.from[i];
    const double next = anew_[i] != 0 ? now : passed_[i];
    compare_.reference[i] = compare_.polarity[i] != 0 ? next : compare_.reference[i];
  }
  signals.look_ahead(compare_, again_.data());
  const double held_beyond = wait ? -kNever : (pixels.holds ? duration_ : kNever);
  const double shot_until = pixels.shoots ? duration_ : -kNever;
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    const bool fired = compare_.polarity[i] != 0, held = fired & (until_[i] > held_beyond);
    const bool may = (again_[i] != 0) | (shot_[i] <= shot_until);
    again_[i] = (fired & !held) & may ? 1.0 : 0.0;
    compare_.reference[i] = held ? kHeld : compare_.reference[i];
  }
  if (!wait) return;
  for (std::size_t i = 0; i < compare_.count; ++i) {
    if (compare_.polarity[i] != 0) until_[i] = kAges;
  }
}

/// Makes the finished pixels inactive, and keeps the others.
template <class Signals>
void PixelPass<Signals>::deactivate(PixelArray& pixels, ActivePixels& active) {
  constexpr double kForever = kAges;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const double duration = duration_, since_epoch = epoch_ns_ + duration_;
  const double no_shot = pixels.shoots ? 0.0 : kForever;
#pragma omp simd
  for (std::size_t i = 0; i < compare_.count; ++i) {
    const double reference = compare_.reference[i], leak = compare_.leak[i];
    const double upper = compare_.upper(i), lower = compare_.lower(i), now = signals.end(i) + leak * duration;
    // The leak lowers both levels: use the upper level at the timer's end and the current lower level, an upper bound.
    const double most = kLeakPerBand * (upper - reference), room = 0.5 * (upper - now);
    double valid = (most < room ? most : room) / leak;
    valid = leak > 0 && valid < kForever ? valid : kForever;
    const bool held = reference == kHeld;
    const double sinks = leak > 0 ? leak * (duration + valid) : 0.0;
    low_[i] = held ? kInfinity : static_cast<float>(lower - leak * duration);
    high_[i] = held ? -kInfinity : static_cast<float>(upper - sinks);
    const double shot = shot_[i] - duration + no_shot, timer = shot < valid ? shot : valid;
    timer_[i] = PixelArray::ticks_after_epoch(since_epoch + timer);
  }
  // Pixels that continue are also written back here: they become inactive later.
  for (std::size_t i = 0; i < compare_.count; ++i) write_back(pixels.noisy_pixels[active.pixel[i]], i);
  if (pixels.has_timers) {
    for (std::size_t i = 0; i < compare_.count; ++i) pixels.timers[active.pixel[i]] = timer_[i];
  }
  pixels.set_bands(compare_.count, active.pixel.data(), low_.data(), high_.data());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < compare_.count; ++i) {
    if (again_[i] != 0) [[unlikely]]
      keep(active, i, kept++);
  }
  compare_.count = active.count = kept;
}

template <class Signals>
void PixelPass<Signals>::keep(ActivePixels& active, std::size_t i, std::size_t to) {
  if (i == to) return;
  active.copy(i, to);
  compare_.copy(i, to);
  signals.copy(i, to);
  draws_[to] = draws_[i], shots_[to] = shots_[i];
  mean_on_[to] = mean_on_[i], mean_off_[to] = mean_off_[i], mean_leak_[to] = mean_leak_[i];
  shot_[to] = shot_[i], until_[to] = until_[i];
}

template <class Signals>
void PixelPass<Signals>::write_back(PixelArray::NoisyPixel& own, std::size_t i) const {
  const double leak = compare_.leak[i];
  own.reference = compare_.reference[i] + leak * epoch_ns_;
  own.on = compare_.on[i], own.off = compare_.off[i];
  own.leak = static_cast<float>(leak * kNsPerS);
  own.draws = draws_[i], own.shots = shots_[i];
  own.shot_at = epoch_ns_ + shot_[i];
  own.until = epoch_ns_ + until_[i];
}

/// The first of random.uniforms(pixel, draw) for each pixel.
template <class Signals>
void PixelPass<Signals>::draw_uniforms(const AddressedRandom& random, const ActivePixels& active, std::uint32_t draw) {
  std::array<PerPixel<std::uint32_t>, 4> words;
  PerPixel<std::uint32_t> draws;
  draws.fill(draw);
  random.bits(active.count, active.pixel.data(), draws.data(),
              {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  for (std::size_t i = 0; i < active.count; ++i) uniform_[i] = AddressedRandom::open_unit(words[0][i], words[1][i]);
}

template <class Signals>
void PixelPass<Signals>::open(PixelArray& pixels, ActivePixels& active) {
  const std::size_t count = compare_.count;
  std::fill_n(compare_.polarity.begin(), count, 1.0);
  std::fill_n(compare_.tau.begin(), count, 0.0);
  std::fill_n(again_.begin(), count, 0.0);
  if (pixels.renews) renew(pixels, active);
  for (std::size_t i = 0; i < count; ++i) compare_.reference[i] = signals.end(i);
  if (pixels.leaks) {
    // A sensor that leaks is already running at the start: it is at a random time between two leak events.
    draw_uniforms(pixels.per_leak, active, 1);
    for (std::size_t i = 0; i < count; ++i) {
      const double threshold = pixels.threshold_on + compare_.on[i];
      if (compare_.leak[i] > 0) compare_.reference[i] -= threshold * uniform_[i];
    }
  }
  if (pixels.shoots) {
    draw_uniforms(pixels.per_shot, active, 0);
    for (std::size_t i = 0; i < count; ++i) {
      const bool dead = std::isinf(compare_.on[i]);
      shot_[i] = dead ? kAges : pixels.shot_interval(uniform_[i]);
      shots_[i] = 1;
    }
  }
  deactivate(pixels, active);
}

template class PixelPass<LinearSignals>;
template class PixelPass<RelaxingSignals>;

}  // namespace esim::inline event_camera

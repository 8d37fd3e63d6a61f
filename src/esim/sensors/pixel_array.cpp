#include "esim/sensors/pixel_array.h"

#include <algorithm>
#include <cmath>

#include "esim/sensors/event_normals.h"
#include "esim/sensors/vector_math.h"

namespace esim {
namespace {

constexpr int kTickBits = 16;  // a tick is 65.5 us: 39 hours fit
constexpr std::int32_t kLastTick = std::numeric_limits<std::int32_t>::max();

// Share of a threshold that may leak before the band is renewed.
constexpr double kLeakPerBand = 0.05;

// A pixel's time between leak events is never shorter than this share of the mean.
constexpr double kMinLeakInterval = 0.05;

// As good as never: three years.
constexpr TimeNs kAges = 100'000'000 * kNsPerSecond;

std::uint32_t item(std::size_t pixel) { return static_cast<std::uint32_t>(pixel); }

}  // namespace

PixelArray::PixelArray(const EventCameraOptions& o, int width_px, int height, std::uint64_t seed, std::uint16_t stream)
    : options(o),
      width(width_px),
      threshold_on(o.threshold_on()),
      threshold_off(o.threshold_off()),
      refractory(to_ns(o.refractory_period_us * 1e-6)),
      holds(refractory > 0 && o.refractory_mode == RefractoryMode::hold),
      in_brightness(o.low_pass_hz > 0 || o.response != PixelResponse::log || o.surround_px > 0),
      leaks(o.leak_rate_hz > 0 || (o.hot_pixels > 0 && o.hot_pixel_rate_hz > 0)),
      shoots(o.shot_noise_hz > 0),
      alarmed(leaks || shoots),
      renews(o.threshold_noise > 0 || (leaks && o.leak_jitter > 0) || o.latency_jitter_us > 0),
      delays(o.latency_us > 0 || o.latency_jitter_us > 0),
      per_event(seed, Purpose::threshold_noise, stream),
      per_shot(seed, Purpose::shot_noise, stream),
      per_leak(seed, Purpose::leak_mismatch, stream) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  states.assign(pixels, {});
  if (refractory > 0) until.assign(pixels, kLongAgo);
  band_low.assign(pixels, std::numeric_limits<float>::infinity());
  band_high.assign(pixels, -std::numeric_limits<float>::infinity());
  if (alarmed) alarms.assign(pixels, kLastTick);
  if (in_brightness) {
    brightness.resize(pixels);
    if (o.low_pass_hz > 0) filtered1.resize(pixels);
    if (o.low_pass_hz > 0 && o.low_pass_order == 2) filtered2.resize(pixels);
  }

  const AddressedRandom mismatch(seed, Purpose::threshold_mismatch, stream);
  const AddressedRandom defects(seed, Purpose::pixel_defects, stream);
  if (renews || leaks || shoots) noise.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    State& state = states[i];
    if (o.threshold_mismatch > 0) {
      const auto [on, off] = mismatch.normals(item(i));
      set_thresholds(state, o.threshold_mismatch * on, o.threshold_mismatch * off);
    }
    const auto [hot, dead] = o.hot_pixels > 0 || o.dead_pixels > 0 ? defects.uniforms(item(i)) : std::array{1.0, 1.0};
    if (leaks) {
      const double rate = hot < o.hot_pixels ? o.hot_pixel_rate_hz : o.leak_rate_hz;
      const double spread =
          o.leak_mismatch_decades > 0 ? std::pow(10.0, o.leak_mismatch_decades * per_leak.normals(item(i))[0]) : 1;
      noise[i].mean_leak = noise[i].leak = static_cast<float>(rate * spread * (threshold_on + state.on));
    }
    if (dead < o.dead_pixels) {
      state.on = state.off = std::numeric_limits<float>::infinity();
      if (leaks) noise[i].mean_leak = noise[i].leak = 0;
    }
    if (renews) noise[i].mean_on = state.on, noise[i].mean_off = state.off;
  }
  if (renews) draw_first_thresholds();
}

void PixelArray::set_thresholds(State& state, double above_on, double above_off) {
  state.on = static_cast<float>(std::max(above_on, kMinContrastThreshold - threshold_on));
  state.off = static_cast<float>(std::max(above_off, kMinContrastThreshold - threshold_off));
}

void PixelArray::draw_first_thresholds() {
  constexpr std::size_t kAtOnce = 4096;
  EventNormals normals;
  std::vector<EventNormals::Address> addresses;
  for (std::size_t first = 0; first < states.size(); first += kAtOnce) {
    addresses.clear();
    for (std::size_t i = first; i < std::min(first + kAtOnce, states.size()); ++i)
      addresses.push_back({item(i), noise[i].draws++});
    normals.draw(per_event, addresses);
    for (std::size_t i = 0; i < addresses.size(); ++i) renew(addresses[i].pixel, normals.of(i));
  }
}

std::int32_t PixelArray::ticks(TimeNs t) const {
  return static_cast<std::int32_t>(std::min<TimeNs>((t - epoch) >> kTickBits, kLastTick - 1));
}

void PixelArray::renew(std::uint32_t pixel, const float* normals) {
  Noise& own = noise[pixel];
  const double sigma = options.threshold_noise;
  set_thresholds(states[pixel], own.mean_on + sigma * normals[0], own.mean_off + sigma * normals[1]);
  if (leaks) {
    const double interval = std::max(1.0 + options.leak_jitter * normals[2], kMinLeakInterval);
    own.leak = static_cast<float>(own.mean_leak / interval);
  }
}

void PixelArray::next_shot(std::uint32_t pixel, double uniform) {
  noise[pixel].shot_at +=
      static_cast<TimeNs>(std::min(-std::log(uniform) / options.shot_noise_hz * 1e9, static_cast<double>(kAges))) + 1;
}

PixelArray::Levels PixelArray::sleep_until_alarm(std::uint32_t pixel, TimeNs now, double signal) {
  double low = level_off(pixel), high = level_on(pixel);
  TimeNs alarm = now + kAges;
  if (shoots) alarm = noise[pixel].shot_at;
  if (const double rate = leak(pixel); rate > 0) {
    // Both levels fall by what leaks: the upper one until the alarm; the lower one is surely not above where it is now.
    const double most = kLeakPerBand * (threshold_on + states[pixel].on);
    const double valid_s = std::min(std::min(most, 0.5 * (high - signal)) / rate, to_seconds(kAges));
    alarm = std::min(alarm, now + static_cast<TimeNs>(valid_s * 1e9));
    const double since = seconds_since_epoch(now);
    low -= rate * since;
    high -= rate * (since + valid_s);
  }
  alarms[pixel] = ticks(alarm);
  return {static_cast<float>(low), static_cast<float>(high)};
}

void PixelArray::set_bands(std::size_t count, const std::uint32_t* which, float* low, float* high) {
  constexpr float kGuard = static_cast<float>(kBandGuard);
  if (in_brightness) {
    for (std::size_t i = 0; i < count; ++i) {
      band_low[which[i]] = low[i] + kGuard;
      band_high[which[i]] = high[i] - kGuard;
    }
    return;
  }
  // From brightness to irradiance.
  constexpr float kLargest = 85.0F;
  for (std::size_t i = 0; i < count; ++i) low[i] = std::max(low[i], -kLargest), high[i] = std::min(high[i], kLargest);
  exponentials(count, low);
  exponentials(count, high);
  const float eps = static_cast<float>(options.log_eps);
  for (std::size_t i = 0; i < count; ++i) {
    band_low[which[i]] = low[i] * (1 + kGuard) - eps;
    band_high[which[i]] = high[i] * (1 - kGuard) - eps;
  }
}

double PixelArray::open(std::uint32_t pixel, double brightness_now, TimeNs t) {
  State& state = states[pixel];
  double signal = brightness_now;
  state.reference = signal;
  if (in_brightness) {
    const auto value = static_cast<float>(brightness_now);
    brightness[pixel] = value;
    if (!filtered1.empty()) filtered1[pixel] = value;
    if (!filtered2.empty()) filtered2[pixel] = value;
  }
  if (const double rate = leak(pixel); rate > 0) {
    // The sensor has been running before: it is anywhere between two leak events.
    signal += rate * seconds_since_epoch(t);
    state.reference = signal - (threshold_on + state.on) * per_leak.uniforms(pixel, 1)[0];
  }
  if (shoots) {
    noise[pixel].shot_at = t;
    next_shot(pixel, per_shot.uniforms(pixel, 0)[0]);
    noise[pixel].shots = 1;
    if (std::isinf(state.on)) noise[pixel].shot_at = t + kAges;  // a dead pixel
  }
  return signal;
}

}  // namespace esim

#include "esim/event_camera/pixel/pixel_array.h"

#include <algorithm>
#include <cmath>

#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

/// Threshold relative to the nominal one, limited to the minimum.
float above(double nominal, double deviation) {
  return static_cast<float>(std::max(deviation, kMinContrastThreshold - nominal));
}

}  // namespace

PixelArray::PixelArray(const EventCameraOptions& o, int width_px, int height_px, std::uint64_t seed,
                       std::uint16_t stream)
    : options(o),
      width(width_px),
      height(height_px),
      threshold_on(o.threshold_on()),
      threshold_off(o.threshold_off()),
      refractory(to_ns(o.refractory_period_us * 1e-6)),
      acknowledged(o.readout.limited()),
      holds((refractory > 0 || acknowledged) && o.refractory_mode == RefractoryMode::hold),
      drops(refractory > 0 && !acknowledged && !holds),
      in_brightness(o.low_pass_hz > 0 || o.response != PixelResponse::log || o.surround_px > 0),
      leaks(o.leak_rate_hz > 0 || (o.hot_pixels > 0 && o.hot_pixel_rate_hz > 0)),
      shoots(o.shot_noise_hz > 0),
      has_timers(leaks || shoots),
      renews(o.threshold_noise > 0 || (leaks && o.leak_jitter > 0) || o.latency_jitter_us > 0),
      delays(o.latency_us > 0 || o.latency_jitter_us > 0),
      clean(!in_brightness && !has_timers && !renews && !delays && !drops),
      per_event(seed, Purpose::threshold_noise, stream),
      per_shot(seed, Purpose::shot_noise, stream),
      per_leak(seed, Purpose::leak_mismatch, stream) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (clean) {
    clean_pixels.resize(pixels);
    if (holds) until.assign(pixels, kLongAgo);
  } else {
    noisy_pixels.resize(pixels);
  }
  band_low.assign(pixels, std::numeric_limits<float>::infinity());
  band_high.assign(pixels, -std::numeric_limits<float>::infinity());
  if (has_timers) timers.assign(pixels, std::numeric_limits<std::int32_t>::max());
  if (in_brightness) {
    brightness.resize(pixels);
    if (o.low_pass_hz > 0) filtered1.resize(pixels);
    if (o.low_pass_hz > 0 && o.low_pass_order == 2) filtered2.resize(pixels);
  }
  make_pixels(seed, stream);
}

/// Draws the fixed parameters of each pixel.
void PixelArray::make_pixels(std::uint64_t seed, std::uint16_t stream) {
  const EventCameraOptions& o = options;
  const AddressedRandom mismatch(seed, Purpose::threshold_mismatch, stream);
  const AddressedRandom defects(seed, Purpose::pixel_defects, stream);
  const std::size_t pixels = band_low.size();
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto item = static_cast<std::uint32_t>(i);
    float on = 0, off = 0;
    if (o.threshold_mismatch > 0) {
      const auto normals = mismatch.normals(item);
      on = above(threshold_on, o.threshold_mismatch * normals[0]);
      off = above(threshold_off, o.threshold_mismatch * normals[1]);
    }
    const auto [hot, dead] = o.hot_pixels > 0 || o.dead_pixels > 0 ? defects.uniforms(item) : std::array{1.0, 1.0};
    float leak = 0;
    if (leaks) {
      const double rate = hot < o.hot_pixels ? o.hot_pixel_rate_hz : o.leak_rate_hz;
      const double spread =
          o.leak_mismatch_decades > 0 ? std::pow(10.0, o.leak_mismatch_decades * per_leak.normals(item)[0]) : 1;
      leak = static_cast<float>(rate * spread * (threshold_on + on));
    }
    if (dead < o.dead_pixels) on = off = std::numeric_limits<float>::infinity(), leak = 0;
    if (clean) {
      clean_pixels[i].on = on, clean_pixels[i].off = off;
    } else {
      NoisyPixel& pixel = noisy_pixels[i];
      pixel.on = pixel.mean_on = on, pixel.off = pixel.mean_off = off;
      pixel.leak = pixel.mean_leak = leak;
    }
  }
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

void PixelArray::hold(std::uint32_t pixel, TimeNs end) {
  if (clean) {
    clean_pixels[pixel].reference = kHeld;
    until[pixel] = end;
  } else {
    noisy_pixels[pixel].reference = kHeld;
    noisy_pixels[pixel].until = static_cast<double>(end - epoch);
  }
  empty_band(pixel);
  if (has_timers) timers[pixel] = std::numeric_limits<std::int32_t>::max();
}

void PixelArray::take_back(std::uint32_t pixel, std::uint32_t events, TimeNs end) {
  if (clean) return;
  NoisyPixel& own = noisy_pixels[pixel];
  if (renews) own.draws -= events;
  if (!shoots) return;
  // Back to the first candidate that is not in the refractory period.
  constexpr double kToUnit = 0x1.0p-32;
  while (own.shots > 1) {
    const auto bits = per_shot.bits(pixel, own.shots - 1);
    const double before = own.shot_at - shot_interval((bits[0] + 0.5) * kToUnit);
    if (before < static_cast<double>(end - epoch)) break;
    own.shot_at = before;
    --own.shots;
  }
}

double PixelArray::shot_interval(double uniform) const {
  return std::floor(std::min(-std::log(uniform) / options.shot_noise_hz * 1e9, kAges)) + 1;
}

}  // namespace esim::inline event_camera

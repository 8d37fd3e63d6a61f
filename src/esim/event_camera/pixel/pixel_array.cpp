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
      effects(o, seed, stream),
      per_event(seed, Purpose::threshold_noise, stream) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (effects.clean) {
    clean_pixels.resize(pixels);
    if (effects.holds) until.assign(pixels, kLongAgo);
  } else {
    noisy_pixels.resize(pixels);
    if (o.labels && static_cast<const Leak&>(effects).active) set_at.resize(pixels);
  }
  bound_low.assign(pixels, std::numeric_limits<float>::infinity());
  bound_high.assign(pixels, -std::numeric_limits<float>::infinity());
  if (effects.timers) timers.assign(pixels, std::numeric_limits<std::int32_t>::max());
  if (effects.in_brightness) brightness.resize(pixels);
  if (effects.poles > 0) filtered1.resize(pixels);
  if (effects.poles > 1) filtered2.resize(pixels);
  make_pixels(seed, stream);
}

/// Draws the fixed parameters of each pixel.
void PixelArray::make_pixels(std::uint64_t seed, std::uint16_t stream) {
  const EventCameraOptions& o = options;
  const AddressedRandom mismatch(seed, Purpose::threshold_mismatch, stream);
  const AddressedRandom defects(seed, Purpose::pixel_defects, stream);
  const std::size_t pixels = bound_low.size();
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto item = static_cast<std::uint32_t>(i);
    float on = 0, off = 0;
    if (o.threshold_mismatch > 0) {
      const auto normals = mismatch.normals(item);
      on = above(threshold_on, o.threshold_mismatch * normals[0]);
      off = above(threshold_off, o.threshold_mismatch * normals[1]);
    }
    const bool dead = o.dead_pixels > 0 && defects.uniforms(item)[1] < o.dead_pixels;
    if (dead) on = off = std::numeric_limits<float>::infinity();
    if (effects.clean) {
      clean_pixels[i].on = on, clean_pixels[i].off = off;
    } else {
      NoisyPixel& pixel = noisy_pixels[i];
      PixelParameters parameters{item, threshold_on, threshold_off, on, off, dead};
      effects.each([&](const auto& effect) { effect.make(pixel, parameters); });
      pixel.on = on, pixel.off = off, pixel.drift = parameters.drift;
    }
  }
}

std::vector<bool> PixelArray::hot(std::uint64_t seed, std::uint16_t stream) const {
  if (options.hot_pixels == 0) return {};
  const AddressedRandom defects(seed, Purpose::pixel_defects, stream);
  std::vector<bool> hot(bound_low.size());
  for (std::size_t i = 0; i < hot.size(); ++i)
    hot[i] = defects.uniforms(static_cast<std::uint32_t>(i))[0] < options.hot_pixels;
  return hot;
}

void PixelArray::set_bounds(std::size_t count, const std::uint32_t* which, float* low, float* high) {
  constexpr float kMargin = static_cast<float>(kBoundMargin);
  if (effects.in_brightness) {
    for (std::size_t i = 0; i < count; ++i) {
      bound_low[which[i]] = low[i] + kMargin;
      bound_high[which[i]] = high[i] - kMargin;
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
    bound_low[which[i]] = low[i] * (1 + kMargin) - eps;
    bound_high[which[i]] = high[i] * (1 - kMargin) - eps;
  }
}

void PixelArray::hold(std::uint32_t pixel, TimeNs end) {
  if (effects.clean) {
    clean_pixels[pixel].reference = kHeld;
    until[pixel] = end;
  } else {
    noisy_pixels[pixel].reference = kHeld;
    noisy_pixels[pixel].until = static_cast<double>(end - epoch);
  }
  empty_bounds(pixel);
  if (effects.timers) timers[pixel] = std::numeric_limits<std::int32_t>::max();
}

void PixelArray::take_back(std::uint32_t pixel, std::uint32_t events, TimeNs end) {
  if (effects.clean) return;
  NoisyPixel& state = noisy_pixels[pixel];
  if (effects.draws) state.draws -= events;
  effects.each_active([&](const auto& effect) { effect.take_back(state, pixel, static_cast<double>(end - epoch)); });
}

}  // namespace esim::inline event_camera

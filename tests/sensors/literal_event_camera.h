#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/random.h"
#include "esim/events/event.h"
#include "esim/sensors/event_camera.h"

namespace esim::test {

/// The event camera as the paper words it, pixel by pixel and level by level, in double precision and without a
/// shortcut: slow, and simple enough to be believed. Frames are whole images at increasing times.
class LiteralEventCamera {
 public:
  LiteralEventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream)
      : options_(options),
        width_(width),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        mismatch_(seed, Purpose::threshold_mismatch, stream),
        noise_(seed, Purpose::threshold_noise, stream) {}

  std::vector<Event> process(const Image<float>& frame, TimeNs t) {
    std::vector<Event> events;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const double brightness = std::log(frame.pixels()[i] + options_.log_eps);
      if (last_t_) {
        walk(i, *last_t_, t, pixels_[i].brightness, brightness, events);
      } else {
        pixels_[i].reference = brightness;
        draw(i);
      }
      pixels_[i].brightness = brightness;
    }
    last_t_ = t;
    std::sort(events.begin(), events.end());
    return events;
  }

 private:
  struct Pixel {
    double brightness = 0, reference = 0, on = 0, off = 0;
    std::uint64_t draws = 0;
    std::optional<TimeNs> reset_until;
  };

  void draw(std::size_t i) {
    Pixel& pixel = pixels_[i];
    const auto item = static_cast<std::uint32_t>(i);
    pixel.on = static_cast<float>(options_.threshold_on() + options_.threshold_mismatch * mismatch_.normals(item)[0]);
    pixel.off = static_cast<float>(options_.threshold_off() + options_.threshold_mismatch * mismatch_.normals(item)[1]);
    if (options_.threshold_noise > 0) {
      pixel.on += options_.threshold_noise * noise_.normals(item, pixel.draws)[0];
      pixel.off += options_.threshold_noise * noise_.normals(item, pixel.draws)[1];
      ++pixel.draws;
    }
    pixel.on = std::max(pixel.on, kMinContrastThreshold);
    pixel.off = std::max(pixel.off, kMinContrastThreshold);
  }

  void walk(std::size_t i, TimeNs t0, TimeNs t1, double b0, double b1, std::vector<Event>& events) {
    Pixel& pixel = pixels_[i];
    const double dt = static_cast<double>(t1 - t0);
    while (true) {
      if (pixel.reset_until) {
        if (*pixel.reset_until > t1) return;
        pixel.reference = b0 + (b1 - b0) * static_cast<double>(*pixel.reset_until - t0) / dt;
        pixel.reset_until.reset();
      }
      int polarity = 0;
      if (b1 >= pixel.reference + pixel.on) polarity = 1;
      if (b1 <= pixel.reference - pixel.off) polarity = -1;
      if (polarity == 0) return;
      pixel.reference += polarity > 0 ? pixel.on : -pixel.off;
      const TimeNs t = std::clamp<TimeNs>(t0 + std::llround((pixel.reference - b0) / (b1 - b0) * dt), t0 + 1, t1);
      events.push_back({t, static_cast<std::uint16_t>(i % static_cast<std::size_t>(width_)),
                        static_cast<std::uint16_t>(i / static_cast<std::size_t>(width_)),
                        static_cast<std::int8_t>(polarity)});
      draw(i);
      if (options_.refractory_period_us > 0) pixel.reset_until = t + to_ns(options_.refractory_period_us * 1e-6);
    }
  }

  EventCameraOptions options_;
  int width_;
  std::vector<Pixel> pixels_;
  AddressedRandom mismatch_, noise_;
  std::optional<TimeNs> last_t_;
};

}  // namespace esim::test

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/pixel_normals.h"
#include "esim/core/random.h"
#include "esim/event_camera/event_camera.h"
#include "esim/events/event.h"

namespace esim::test {

/// A literal implementation of the event camera's options, without low-pass and surround: pixel by pixel and event by
/// event, in double precision and without optimisations. Slow, but simple enough to verify by reading. It draws the
/// same random numbers. Frames are whole images at increasing times.
class LiteralEventCamera {
 public:
  LiteralEventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream)
      : options_(options),
        width_(width),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        draws_(pixels_.size(), 0),
        mismatch_(seed, Purpose::threshold_mismatch, stream),
        per_event_(seed, Purpose::threshold_noise, stream),
        leak_(seed, Purpose::leak_mismatch, stream),
        shot_(seed, Purpose::shot_noise, stream),
        defects_(seed, Purpose::pixel_defects, stream) {}

  std::vector<Event> process(const Image<float>& frame, TimeNs t) {
    std::vector<Event> events;
    if (last_t_ && options_.readout.limited()) {
      read_out(frame, *last_t_, t, events);
    } else if (last_t_) {
      for (std::size_t i = 0; i < pixels_.size(); ++i) {
        while (const auto event = next_event(i, *last_t_, t, frame.pixels()[i])) events.push_back(*event);
      }
    }
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const double light = frame.pixels()[i];
      if (!last_t_) open(i, t, light);
      pixels_[i].light = light;
      pixels_[i].from = 0;
    }
    last_t_ = t;
    std::sort(events.begin(), events.end());
    return events;
  }

 private:
  struct Pixel {
    double light = 0, reference = 0, on = 0, off = 0;
    double leak = 0, reference_t = 0;  // the reference falls by `leak` per second since then, s
    std::array<float, 4> normals{};
    std::uint64_t shots = 0;
    TimeNs shot_at = std::numeric_limits<TimeNs>::max();
    std::optional<TimeNs> busy_until;  // refractory, or waiting for the readout
    double from = 0;                   // s after the previous frame: start of the search
  };

  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double brightness(double light) const {
    if (options_.response == PixelResponse::log) return std::log(light + options_.log_eps);
    const double knee = options_.lin_log_knee;
    return light > knee ? std::log(255 * light) : light / knee * std::log(255 * knee);
  }
  double intensity(double light) const { return (light + options_.dark_irradiance) / (1 + options_.dark_irradiance); }
  bool leaks() const { return options_.leak_rate_hz > 0 || options_.hot_pixels > 0; }

  void open(std::size_t i, TimeNs t, double light) {
    Pixel& pixel = pixels_[i];
    const auto item = static_cast<std::uint32_t>(i);
    draw(i);
    pixel.reference = brightness(light);
    pixel.reference_t = to_seconds(t);
    if (pixel.leak > 0) pixel.reference -= pixel.on * leak_.uniforms(item, 1)[0];
    const bool dead = pixel.on == kNever;
    if (options_.shot_noise_hz > 0 && !dead) {
      pixel.shot_at = t;
      next_shot(pixel, shot_.uniforms(item, 0)[0]);
    }
  }

  void next_shot(Pixel& pixel, double uniform) const {
    pixel.shot_at += static_cast<TimeNs>(-std::log(uniform) / options_.shot_noise_hz * 1e9) + 1;
    ++pixel.shots;
  }

  /// Draws the parameters that hold until the next event.
  void draw(std::size_t i) {
    Pixel& pixel = pixels_[i];
    const auto item = static_cast<std::uint32_t>(i);
    const auto fixed = mismatch_.normals(item);
    // The random parts of the thresholds are stored as floats.
    const auto above = [](double nominal, double deviation) {
      return static_cast<float>(std::max(deviation, kMinContrastThreshold - nominal));
    };
    const float mean_on = above(options_.threshold_on(), options_.threshold_mismatch * fixed[0]);
    const float mean_off = above(options_.threshold_off(), options_.threshold_mismatch * fixed[1]);
    float on = mean_on, off = mean_off;
    if (options_.threshold_noise > 0 || (leaks() && options_.leak_jitter > 0) || options_.latency_jitter_us > 0) {
      PerPixel<std::uint32_t> items{}, draws{};
      items[0] = item, draws[0] = draws_[i]++;
      normals_.draw(per_event_, 1, items, draws);
      for (std::size_t k = 0; k < 4; ++k) pixel.normals[k] = normals_[k][0];
      on = above(options_.threshold_on(), mean_on + options_.threshold_noise * pixel.normals[0]);
      off = above(options_.threshold_off(), mean_off + options_.threshold_noise * pixel.normals[1]);
    }
    pixel.on = options_.threshold_on() + on;
    pixel.off = options_.threshold_off() + off;
    const auto [hot, dead] = defects_.uniforms(item);
    if (leaks()) {
      const double rate = hot < options_.hot_pixels ? options_.hot_pixel_rate_hz : options_.leak_rate_hz;
      const double spread = std::pow(10.0, options_.leak_mismatch_decades * leak_.normals(item)[0]);
      const auto mean_leak = static_cast<float>(rate * spread * (options_.threshold_on() + mean_on));
      pixel.leak = static_cast<float>(mean_leak / std::max(1 + options_.leak_jitter * pixel.normals[2], 0.05));
    }
    if (dead < options_.dead_pixels) pixel.on = pixel.off = kNever, pixel.leak = 0;
  }

  /// The next event of a pixel between the frames at t0 and t1.
  std::optional<Event> next_event(std::size_t i, TimeNs t0, TimeNs t1, double light1) {
    Pixel& pixel = pixels_[i];
    const double start = brightness(pixel.light), end = brightness(light1), duration = to_seconds(t1 - t0);
    const double slope = (end - start) / duration;
    const auto level_at = [&](double tau) { return start + slope * tau; };  // tau in s after t0
    const auto light_at = [&](double tau) { return pixel.light + (light1 - pixel.light) * tau / duration; };
    const bool holds = options_.refractory_mode == RefractoryMode::hold, read_out = options_.readout.limited();
    while (true) {
      if (holds && pixel.busy_until) {
        if (*pixel.busy_until > t1) return std::nullopt;
        pixel.from = to_seconds(*pixel.busy_until - t0);
        pixel.reference = level_at(pixel.from);
        pixel.reference_t = to_seconds(t0) + pixel.from;
        pixel.busy_until.reset();
      }
      const double from = pixel.from;
      // The levels fall with the reference.
      const double reference_at_start = pixel.reference - pixel.leak * (to_seconds(t0) - pixel.reference_t);
      double tau = kNever;
      int polarity = 0;
      const double approach = slope + pixel.leak;
      if (approach > 0) tau = (reference_at_start + pixel.on - start) / approach, polarity = 1;
      if (approach < 0) tau = (reference_at_start - pixel.off - start) / approach, polarity = -1;
      if (tau > duration) tau = kNever;
      tau = std::max(tau, from);

      bool noise = false;
      while (pixel.shot_at <= t1 && to_seconds(pixel.shot_at - t0) < tau) {
        const double at = to_seconds(pixel.shot_at - t0);
        const auto bits = shot_.bits(static_cast<std::uint32_t>(i), pixel.shots);
        next_shot(pixel, (bits[0] + 0.5) * 0x1.0p-32);
        if (at <= 0 || at < from) continue;
        const double passes = 1 - (1 - options_.shot_noise_at_white) * std::min(intensity(light_at(at)), 1.0);
        if (bits[1] * 0x1.0p-32 >= passes) continue;
        tau = at, noise = true, polarity = (bits[2] & 1U) != 0 ? 1 : -1;
        break;
      }
      if (tau == kNever) return std::nullopt;

      const TimeNs t = std::clamp<TimeNs>(t0 + std::llround(tau * 1e9), t0 + 1, t1);
      const double passed = reference_at_start - pixel.leak * tau + (polarity > 0 ? pixel.on : -pixel.off);
      draw(i);
      const bool lost = !holds && !read_out && pixel.busy_until && t < *pixel.busy_until;
      if (!lost && options_.refractory_period_us > 0) pixel.busy_until = t + refractory();
      pixel.reference = noise ? level_at(tau) : passed;
      pixel.reference_t = to_seconds(t0) + tau;
      pixel.from = tau;
      if (!lost) {
        return Event{t + delay(pixel, light_at(tau)), static_cast<std::uint16_t>(i % static_cast<std::size_t>(width_)),
                     static_cast<std::uint16_t>(i / static_cast<std::size_t>(width_)),
                     static_cast<std::int8_t>(polarity)};
      }
    }
  }

  TimeNs refractory() const { return to_ns(options_.refractory_period_us * 1e-6); }

  /// Processes one request, row and acknowledgement at a time.
  void read_out(const Image<float>& frame, TimeNs t0, TimeNs t1, std::vector<Event>& events) {
    constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::max();
    const ReadoutOptions& o = options_.readout;
    const bool holds = options_.refractory_mode == RefractoryMode::hold;
    const TimeNs per_event = o.rate_mev_per_s > 0 ? std::llround(1e3 / o.rate_mev_per_s) : 0;
    const TimeNs per_row = std::llround(o.row_time_us * 1e3), prompt = std::min<TimeNs>(1000, refractory() / 100);
    const auto look = [&](std::size_t i) {
      while (const auto event = next_event(i, t0, t1, frame.pixels()[i])) {
        requests_.insert(*event);
        if (!holds) continue;
        pixels_[i].busy_until = kNoTime;  // until it is read out
        return;
      }
    };
    blind_until_.resize(pixels_.size(), std::numeric_limits<TimeNs>::min());
    for (std::size_t i = 0; i < pixels_.size(); ++i) look(i);
    while (true) {
      const TimeNs arrival = requests_.empty() ? kNoTime : requests_.begin()->t;
      const TimeNs service = waiting_.empty() ? kNoTime : std::max(free_at_, waiting_[0].t);
      if (std::min(arrival, service) > t1) return;
      if (arrival <= service) {  // requests that arrive at the time of a service are included
        const Event request = *requests_.begin();
        requests_.erase(requests_.begin());
        const auto same = [&](const Event& e) { return e.x == request.x && e.y == request.y; };
        const bool blind = arrival < blind_until_[pixel_of(request)] || std::ranges::any_of(waiting_, same);
        if (holds || !blind) waiting_.push_back(request);
        continue;
      }
      std::vector<Event> served;
      std::ranges::copy_if(waiting_, std::back_inserter(served), [&](const Event& e) { return e.y == waiting_[0].y; });
      const int row = waiting_[0].y;
      std::erase_if(waiting_, [&](const Event& e) { return e.y == row; });
      free_at_ = service + std::max<TimeNs>(1, per_row + per_event * static_cast<TimeNs>(served.size()));
      for (const Event& request : served) {
        events.push_back({service, request.x, request.y, request.polarity});
        const std::size_t i = pixel_of(request);
        const TimeNs until = (service - request.t > prompt ? service : request.t) + refractory();
        blind_until_[i] = service + refractory();
        if (!holds) continue;
        pixels_[i].busy_until = until;
        look(i);
      }
    }
  }

  std::size_t pixel_of(const Event& event) const {
    return static_cast<std::size_t>(event.y) * static_cast<std::size_t>(width_) + event.x;
  }

  TimeNs delay(const Pixel& pixel, double light) const {
    const double share = options_.latency_light_share;
    const double us =
        (options_.latency_us + options_.latency_jitter_us * pixel.normals[3]) * (1 - share + share / intensity(light));
    return std::llround(std::max(us, 0.0) * 1e3);
  }

  EventCameraOptions options_;
  int width_;
  std::vector<Pixel> pixels_;
  std::vector<std::uint32_t> draws_;
  PixelNormals normals_;
  AddressedRandom mismatch_, per_event_, leak_, shot_, defects_;
  std::optional<TimeNs> last_t_;

  // The readout: future requests, waiting requests, and the time at which the reader is free.
  std::set<Event> requests_;
  std::vector<Event> waiting_;
  std::vector<TimeNs> blind_until_;
  TimeNs free_at_ = std::numeric_limits<TimeNs>::min();
};

}  // namespace esim::test

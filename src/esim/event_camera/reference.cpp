// The model of the event camera. Numbers in brackets are the equations of docs/methods/pixel.md.
#include "esim/event_camera/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "esim/core/pixel_normals.h"
#include "esim/core/random.h"
#include "esim/event_camera/center_surround.h"
#include "esim/event_camera/reference_signal.h"

namespace esim::inline event_camera {
namespace {

constexpr TimeNs kNoTime = std::numeric_limits<TimeNs>::max();
constexpr double kToUnit = 0x1.0p-32;  // from a random word to [0, 1)

/// Four standard normal deviates.
std::array<float, 4> normals_of(const AddressedRandom& random, std::uint32_t pixel, std::uint32_t draw) {
  PixelNormals normals{};
  PerPixel<std::uint32_t> pixels{}, draws{};
  pixels[0] = pixel, draws[0] = draw;
  normals.draw(random, 1, pixels, draws);
  return {normals[0][0], normals[1][0], normals[2][0], normals[3][0]};
}

/// An event with its label, which does not matter for the order of events.
struct Labelled : Event {
  EventLabel label;
};

}  // namespace

/// The state of the camera, and one function per step.
class ReferenceEventCamera::Model {
 public:
  Model(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);
  std::vector<Event> process(const Image<float>& irradiance, TimeNs t);
  const std::vector<EventLabel>& labels() const { return labels_; }

 private:
  struct Pixel {
    double light = 0, brightness = 0;     // E and L at the previous frame
    double filtered1 = 0, filtered2 = 0;  // after each pole, then
    double reference = 0;                 // R, then; it falls by `leak` per second
    double on = 0, off = 0, leak = 0;     // thresholds, and 1/s; constant between two events
    double mean_on = 0, mean_off = 0;     // C+ and C- of the pixel: thresholds without their noise
    bool hot = false;
    std::uint32_t draws = 0, shots = 0;  // number of draws for events, and of candidates of shot noise
    TimeNs shot_at = kNoTime;            // next candidate of shot noise
    std::optional<TimeNs> busy_until;    // end of the refractory period; kNoTime while it waits for the readout
    double from = 0;                     // s after the previous frame: nothing is searched before
    double set_at = 0;                   // when the reference was set, s after the previous frame
    std::array<float, 4> normals{};      // n' of the last event: ON, OFF, leak, latency
  };

  // Signal.
  double brightness(double light) const;
  std::vector<double> brightness_of(const Image<float>& irradiance, TimeNs t);
  double intensity(double light) const;
  ReferenceSignal signal_of(const Pixel& pixel, double light, double brightness, TimeNs t0, TimeNs t1) const;

  // Events.
  void open(std::size_t i, double light, double brightness, TimeNs t);
  void draw_parameters(std::size_t i);
  void next_shot(Pixel& pixel, double uniform) const;
  bool find_shot(std::size_t i, const ReferenceSignal& signal, double& tau, int& polarity);
  NewLabel label(const Pixel& pixel, const ReferenceSignal& signal, double tau, int polarity, bool shot) const;
  std::optional<Labelled> next_event(std::size_t i, const ReferenceSignal& signal);

  // Time stamps.
  TimeNs delay(const Pixel& pixel, double light) const;
  void read_out(const std::vector<ReferenceSignal>& signals, std::vector<Labelled>& events);
  void find_requests(std::size_t i, const ReferenceSignal& signal);
  void raise(const Labelled& request, const std::vector<ReferenceSignal>& signals);
  void serve_row(TimeNs service, const std::vector<ReferenceSignal>& signals, std::vector<Labelled>& events);
  void acknowledge(const Event& request, TimeNs t, const std::vector<ReferenceSignal>& signals);
  std::size_t pixel_of(const Event& event) const;

  EventCameraOptions options_;
  int width_;
  bool holds_;
  TimeNs refractory_;
  std::vector<Pixel> pixels_;
  std::optional<CenterSurround> surround_;
  Image<float> surrounded_;
  AddressedRandom mismatch_, per_event_, leak_, shot_, defects_;
  std::optional<TimeNs> last_t_;
  std::vector<EventLabel> labels_;

  // The readout: future requests, waiting requests, and the time at which the reader is free.
  std::set<Labelled> requests_;
  std::vector<Labelled> waiting_;
  std::vector<TimeNs> blind_until_;
  double free_at_ = -std::numeric_limits<double>::infinity();  // ns after `epoch_`
  TimeNs epoch_ = 0;
};

// ---------------------------------------------------------------------------------------------------------- Signal --

/// (1) L = ln(E + log_eps), or v2e's response.
double ReferenceEventCamera::Model::brightness(double light) const {
  if (options_.response == PixelResponse::log) return std::log(light + options_.log_eps);
  const double knee = options_.lin_log_knee;
  return light > knee ? std::log(255 * light) : light / knee * std::log(255 * knee);
}

/// (2) The brightness of all pixels, minus that of their surround: the only step in which pixels depend on each other.
std::vector<double> ReferenceEventCamera::Model::brightness_of(const Image<float>& irradiance, TimeNs t) {
  std::vector<double> values;
  for (const float light : irradiance.pixels()) values.push_back(brightness(light));
  if (!surround_) return values;
  std::copy(values.begin(), values.end(), surrounded_.data());
  if (last_t_) {
    surround_->advance(surrounded_, to_seconds(t - *last_t_));
  } else {
    surround_->open(surrounded_);
  }
  return {surrounded_.pixels().begin(), surrounded_.pixels().end()};
}

/// (4) i = (E + d) / (1 + d).
double ReferenceEventCamera::Model::intensity(double light) const {
  return (light + options_.dark_irradiance) / (1 + options_.dark_irradiance);
}

ReferenceSignal ReferenceEventCamera::Model::signal_of(const Pixel& pixel, double light, double brightness, TimeNs t0,
                                                       TimeNs t1) const {
  const double duration = to_seconds(t1 - t0);
  const int poles = options_.low_pass_hz > 0 ? options_.low_pass_order : 0;
  // (5) The -3 dB frequency of all poles together is low_pass_hz i, at the mean irradiance of the segment.
  const double mean = (pixel.light + 4 * std::sqrt(pixel.light * light) + light) / 6;
  const double per_pole = poles == 2 ? 1 / std::sqrt(std::numbers::sqrt2 - 1) : 1;
  return {.t0 = t0,
          .t1 = t1,
          .duration = duration,
          .light0 = pixel.light,
          .light1 = light,
          .start = pixel.brightness,
          .slope = (brightness - pixel.brightness) / duration,
          .poles = poles,
          .rate = 2 * std::numbers::pi * options_.low_pass_hz * per_pole * intensity(mean),
          .filtered1 = pixel.filtered1,
          .filtered2 = pixel.filtered2};
}

// ---------------------------------------------------------------------------------------------------------- Events --

ReferenceEventCamera::Model::Model(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                                   std::uint16_t stream)
    : options_(options),
      width_(width),
      holds_(options.refractory_mode == RefractoryMode::hold),
      refractory_(to_ns(options.refractory_period_us * 1e-6)),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      mismatch_(seed, Purpose::threshold_mismatch, stream),
      per_event_(seed, Purpose::threshold_noise, stream),
      leak_(seed, Purpose::leak_mismatch, stream),
      shot_(seed, Purpose::shot_noise, stream),
      defects_(seed, Purpose::pixel_defects, stream),
      blind_until_(pixels_.size(), std::numeric_limits<TimeNs>::min()) {
  if (options.surround_px == 0) return;
  surround_.emplace(options.surround_px, options.surround_ms * 1e-3, width, height);
  surrounded_ = Image<float>(width, height);
}

std::vector<Event> ReferenceEventCamera::Model::process(const Image<float>& irradiance, TimeNs t) {
  const std::vector<double> brightness = brightness_of(irradiance, t);
  std::vector<ReferenceSignal> signals;
  std::vector<Labelled> events;
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const double light = irradiance.pixels()[i];
    if (!last_t_) open(i, light, brightness[i], t);
    signals.push_back(signal_of(pixels_[i], light, brightness[i], last_t_.value_or(t), t));
  }
  if (!last_t_) {
    epoch_ = t;
  } else if (options_.readout.limited()) {
    read_out(signals, events);
  } else {
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      while (const auto event = next_event(i, signals[i])) events.push_back(*event);
    }
  }
  for (std::size_t i = 0; last_t_ && i < pixels_.size(); ++i) {
    Pixel& pixel = pixels_[i];
    const double duration = signals[i].duration;
    pixel.light = signals[i].light1, pixel.brightness = brightness[i];
    if (signals[i].poles > 0) pixel.filtered1 = signals[i].after(1, duration);
    if (signals[i].poles > 1) pixel.filtered2 = signals[i].after(2, duration);
    pixel.reference -= pixel.leak * duration;
    pixel.from = 0;
    pixel.set_at -= duration;
  }
  last_t_ = t;
  std::stable_sort(events.begin(), events.end());
  labels_.clear();
  for (const Labelled& event : events) labels_.push_back(event.label);
  return {events.begin(), events.end()};
}

/// The first frame.
void ReferenceEventCamera::Model::open(std::size_t i, double light, double brightness, TimeNs t) {
  Pixel& pixel = pixels_[i];
  const auto item = static_cast<std::uint32_t>(i);
  draw_parameters(i);
  const auto mismatch = mismatch_.normals(item);
  const auto mean = [&](double nominal, double normal) {
    return std::max(nominal + options_.threshold_mismatch * normal, kMinContrastThreshold);
  };
  pixel.mean_on = mean(options_.threshold_on(), mismatch[0]),
  pixel.mean_off = mean(options_.threshold_off(), mismatch[1]);
  pixel.light = light;
  pixel.brightness = pixel.filtered1 = pixel.filtered2 = pixel.reference = brightness;
  // (8) Each pixel is at a random phase between two leak events.
  if (pixel.leak > 0) {
    const double leaked = pixel.on * leak_.uniforms(item, 1)[0];
    pixel.reference -= leaked;
    pixel.set_at = -leaked / pixel.leak;
  }
  // (9) The first candidate of shot noise. (10) A dead pixel has none.
  if (options_.shot_noise_hz > 0 && pixel.on < ReferenceSignal::kNever) {
    pixel.shot_at = t;
    next_shot(pixel, shot_.uniforms(item, 0)[0]);
  }
}

/// Draws the parameters that hold until the next event.
void ReferenceEventCamera::Model::draw_parameters(std::size_t i) {
  Pixel& pixel = pixels_[i];
  const auto item = static_cast<std::uint32_t>(i);
  pixel.normals = normals_of(per_event_, item, pixel.draws++);
  // (7) theta = max(0.01, C + mismatch n + noise n'). Deviations from C are floats, here and in EventCamera.
  const auto deviation = [](double nominal, double random) {
    return static_cast<float>(std::max(random, kMinContrastThreshold - nominal));
  };
  const double c_on = options_.threshold_on(), c_off = options_.threshold_off(), noise = options_.threshold_noise;
  const auto fixed = mismatch_.normals(item);
  const float mean_on = deviation(c_on, options_.threshold_mismatch * fixed[0]);
  const float mean_off = deviation(c_off, options_.threshold_mismatch * fixed[1]);
  pixel.on = c_on + deviation(c_on, mean_on + noise * pixel.normals[0]);
  pixel.off = c_off + deviation(c_off, mean_off + noise * pixel.normals[1]);
  // (8) R falls by f kappa theta per second, kappa = 10^(decades n); jitter changes the time to the next leak event.
  // (10) Hot pixels leak at their own rate. Dead pixels never reach a threshold.
  const auto [hot, dead] = defects_.uniforms(item);
  pixel.hot = hot < options_.hot_pixels;
  const double f = pixel.hot ? options_.hot_pixel_rate_hz : options_.leak_rate_hz;
  const double kappa = std::pow(10.0, options_.leak_mismatch_decades * leak_.normals(item)[0]);
  const auto mean_leak = static_cast<float>(f * kappa * (c_on + mean_on));
  pixel.leak = static_cast<float>(mean_leak / std::max(1 + options_.leak_jitter * pixel.normals[2], 0.05));
  if (dead < options_.dead_pixels) pixel.on = pixel.off = ReferenceSignal::kNever, pixel.leak = 0;
}

/// (9) Candidates of shot noise are a Poisson process at the rate in the dark.
void ReferenceEventCamera::Model::next_shot(Pixel& pixel, double uniform) const {
  pixel.shot_at += static_cast<TimeNs>(-std::log(uniform) / options_.shot_noise_hz * 1e9) + 1;
  ++pixel.shots;
}

/// (9) The first candidate before tau that is accepted, with probability 1 - (1 - w) i, replaces the crossing at tau.
bool ReferenceEventCamera::Model::find_shot(std::size_t i, const ReferenceSignal& signal, double& tau, int& polarity) {
  Pixel& pixel = pixels_[i];
  while (pixel.shot_at <= signal.t1 && to_seconds(pixel.shot_at - signal.t0) < tau) {
    const double at = to_seconds(pixel.shot_at - signal.t0);
    const auto bits = shot_.bits(static_cast<std::uint32_t>(i), pixel.shots);
    next_shot(pixel, (bits[0] + 0.5) * kToUnit);
    if (at <= 0 || at < pixel.from) continue;  // in reset
    const double accepted = 1 - (1 - options_.shot_noise_at_white) * std::min(intensity(signal.light(at)), 1.0);
    if (bits[1] * kToUnit >= accepted) continue;
    tau = at;
    polarity = (bits[2] & 1U) != 0 ? 1 : -1;
    return true;
  }
  return false;
}

/// (15) What the change of F - R since the reference was set consists of. Noise is what thresholds with noise, or shot
/// noise, add to signal and leak.
NewLabel ReferenceEventCamera::Model::label(const Pixel& pixel, const ReferenceSignal& signal, double tau, int polarity,
                                            bool shot) const {
  const double nominal = polarity > 0 ? pixel.mean_on : -pixel.mean_off;
  const double reached = polarity > 0 ? pixel.on : -pixel.off;
  const double leak = pixel.leak * (tau - pixel.set_at);
  const double change = shot ? signal.value(tau) + pixel.leak * tau - pixel.reference : reached;
  NewLabel label;
  label.signal = static_cast<float>(change - leak);
  label.noise = static_cast<float>(nominal - change);
  label.leak = static_cast<float>(leak);
  label.polarity = static_cast<std::int8_t>(polarity);
  label.is_noise = shot ? 1 : 0;
  return label;
}

/// The next event of a pixel between two frames.
std::optional<Labelled> ReferenceEventCamera::Model::next_event(std::size_t i, const ReferenceSignal& signal) {
  Pixel& pixel = pixels_[i];
  while (true) {
    // (11) hold: until the end of the refractory period the pixel sees nothing; then R = F.
    if (holds_ && pixel.busy_until) {
      if (*pixel.busy_until > signal.t1) return std::nullopt;
      pixel.from = to_seconds(*pixel.busy_until - signal.t0);
      pixel.reference = signal.value(pixel.from) + pixel.leak * pixel.from;
      pixel.set_at = pixel.from;
      pixel.busy_until.reset();
    }
    // (6) The comparator: F against R + theta+ and R - theta-, or F + leak tau against these levels at t0.
    const double upper = pixel.reference + pixel.on, lower = pixel.reference - pixel.off;
    int polarity = 0;
    double tau = signal.first_crossing(pixel.from, pixel.leak, lower, upper, polarity);
    // (9) Shot noise may come first.
    const bool shot = find_shot(i, signal, tau, polarity);
    if (tau == ReferenceSignal::kNever) return std::nullopt;
    const TimeNs t = std::clamp<TimeNs>(signal.t0 + std::llround(tau * 1e9), signal.t0 + 1, signal.t1);
    NewLabel label = this->label(pixel, signal, tau, polarity, shot);
    label.t_ideal = t;
    // (6) The level becomes the reference; (9) after shot noise, F. (7), (8) New thresholds and leak.
    const double level = shot ? signal.value(tau) : (polarity > 0 ? upper : lower) - pixel.leak * tau;
    draw_parameters(i);
    pixel.reference = level + pixel.leak * tau;  // at t0, as before
    pixel.from = pixel.set_at = tau;
    // (11) drop: the event is lost, but R has changed. With a readout, read_out() decides.
    const bool readout = options_.readout.limited();
    if (!holds_ && !readout && pixel.busy_until && t < *pixel.busy_until) continue;
    if (refractory_ > 0 && !readout) pixel.busy_until = t + refractory_;
    // (12) The time stamp.
    const auto pixels_per_row = static_cast<std::size_t>(width_);
    EventLabel explained;
    explain(label, pixel.hot, explained);
    return Labelled{{t + delay(pixel, signal.light(tau)), static_cast<std::uint16_t>(i % pixels_per_row),
                     static_cast<std::uint16_t>(i / pixels_per_row), static_cast<std::int8_t>(polarity)},
                    explained};
  }
}

// ----------------------------------------------------------------------------------------------------- Time stamps --

/// (12) max(0, latency + jitter n') (1 - s + s / i).
TimeNs ReferenceEventCamera::Model::delay(const Pixel& pixel, double light) const {
  const double us = options_.latency_us + options_.latency_jitter_us * pixel.normals[3];
  const double s = options_.latency_light_share;
  return std::llround(std::max(us, 0.0) * (1 - s + s / intensity(light)) * 1e3);
}

std::size_t ReferenceEventCamera::Model::pixel_of(const Event& event) const {
  return static_cast<std::size_t>(event.y) * static_cast<std::size_t>(width_) + event.x;
}

/// (13) Between two frames: requests arrive, and the reader serves rows, in the order of time.
void ReferenceEventCamera::Model::read_out(const std::vector<ReferenceSignal>& signals, std::vector<Labelled>& events) {
  for (std::size_t i = 0; i < pixels_.size(); ++i) find_requests(i, signals[i]);
  while (true) {
    const TimeNs arrival = requests_.empty() ? kNoTime : requests_.begin()->t;
    const double free = std::max(std::ceil(free_at_), -1e18);
    const TimeNs service = waiting_.empty() ? kNoTime : std::max(epoch_ + static_cast<TimeNs>(free), waiting_[0].t);
    if (std::min(arrival, service) > signals[0].t1) return;
    if (arrival <= service) {  // requests that arrive at the time of a service are included
      const Labelled request = *requests_.begin();
      requests_.erase(requests_.begin());
      raise(request, signals);
    } else {
      serve_row(service, signals, events);
    }
  }
}

/// (14) A pixel that is held in reset waits for the acknowledgement of its event.
void ReferenceEventCamera::Model::find_requests(std::size_t i, const ReferenceSignal& signal) {
  while (const auto event = next_event(i, signal)) {
    requests_.insert(*event);
    if (!holds_) continue;
    pixels_[i].busy_until = kNoTime;
    return;
  }
}

/// (14) One request per pixel. A request beyond the length of the queue is lost, as if it were read immediately.
void ReferenceEventCamera::Model::raise(const Labelled& request, const std::vector<ReferenceSignal>& signals) {
  const auto same = [&](const Event& e) { return e.x == request.x && e.y == request.y; };
  const bool blind = request.t < blind_until_[pixel_of(request)] || std::ranges::any_of(waiting_, same);
  if (!holds_ && blind) return;
  const auto capacity = static_cast<std::size_t>(options_.readout.queue_events);
  if (capacity > 0 && waiting_.size() == capacity) return acknowledge(request, request.t, signals);
  waiting_.push_back(request);
}

/// (13) The row of the first waiting request: all its events together; then the reader is busy.
void ReferenceEventCamera::Model::serve_row(TimeNs service, const std::vector<ReferenceSignal>& signals,
                                            std::vector<Labelled>& events) {
  const ReadoutOptions& o = options_.readout;
  const int row = waiting_[0].y;
  const auto in_row = [&](const Event& e) { return e.y == row; };
  std::vector<Labelled> served;
  std::ranges::copy_if(waiting_, std::back_inserter(served), in_row);
  std::erase_if(waiting_, in_row);
  const double per_event = o.rate_mev_per_s > 0 ? 1e3 / o.rate_mev_per_s : 0;
  const double busy = std::max(1.0, o.row_time_us * 1e3 + per_event * static_cast<double>(served.size()));
  // Fractions of a nanosecond count while the reader is continuously busy.
  const auto start = static_cast<double>(service - epoch_);
  free_at_ = (start > std::ceil(free_at_) ? start : free_at_) + busy;
  for (const Labelled& request : served) {
    events.push_back({{service, request.x, request.y, request.polarity}, request.label});
    acknowledge(request, service, signals);
  }
}

/// (14) The refractory period begins at the acknowledgement, or at the event if that is practically the same.
void ReferenceEventCamera::Model::acknowledge(const Event& request, TimeNs t,
                                              const std::vector<ReferenceSignal>& signals) {
  const std::size_t i = pixel_of(request);
  blind_until_[i] = t + refractory_;
  if (!holds_) return;
  const TimeNs immediate = std::min<TimeNs>(1000, refractory_ / 100);
  pixels_[i].busy_until = (t - request.t > immediate ? t : request.t) + refractory_;
  find_requests(i, signals[i]);
}

// ---------------------------------------------------------------------------------------------------------- Public --

ReferenceEventCamera::ReferenceEventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                                           std::uint16_t stream)
    : model_(std::make_unique<Model>(options, width, height, seed, stream)) {}

ReferenceEventCamera::~ReferenceEventCamera() = default;

std::vector<Event> ReferenceEventCamera::process(const Image<float>& irradiance, TimeNs t) {
  return model_->process(irradiance, t);
}

const std::vector<EventLabel>& ReferenceEventCamera::labels() const { return model_->labels(); }

}  // namespace esim::inline event_camera

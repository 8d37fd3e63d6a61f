#include "esim/fit/circuit/circuit_model.h"

#include <algorithm>
#include <utility>

#include "esim/core/parallel.h"
#include "esim/event_camera/noise_rate.h"
#include "esim/fit/circuit/circuit_simulation.h"

namespace esim::inline fit {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kSoft = 0.2;  // of the thresholds: the transition of events_of_lamp() to no events
// Of a pixel, before and while they count: ON and OFF events of a lamp, OFF events in constant light. At first, all
// references are equally probable, which is not so later: of a lamp with 1.6 ON events in a period, their number
// decreases by 4 % after 4 periods, by 1 % after 12, and no more after 18.
constexpr double kSettlingEvents = 64, kLampEvents = 24, kSettlingNoise = 4, kNoiseEvents = 4;
constexpr double kMinPeriods = 8, kMaxPeriods = 40, kLongest_s = 20;

void set_value(EventCameraOptions& o, CircuitModel::Index k, double value) {
  switch (k) {
    case CircuitModel::kOn:
      o.contrast_threshold_on = value;
      break;
    case CircuitModel::kOff:
      o.contrast_threshold_off = value;
      break;
    case CircuitModel::kPhotocurrent:
      o.circuit->photocurrent_fa_per_lux = value;
      break;
    case CircuitModel::kFollower:
      o.circuit->source_follower_hz = value;
      break;
    case CircuitModel::kCharge:
      o.circuit->photodiode_charge_e = value;
      break;
    default:
      o.circuit->dark_current_fa = value;
      break;
  }
}

/// ON and OFF events of a pixel in a period, on average. Both poles attenuate the modulation m of the photocurrent by
/// h, so that brightness swings by S = 2 artanh(m h). At the turning points, a part of the swing is left that no
/// threshold reaches: half of C+ and of C- on average. In each refractory period T, the pixel misses what the signal
/// moves meanwhile: 2 f S T.
std::pair<double, double> events_of_lamp(const EventCameraOptions& o, const KnownLight& light) {
  const TimeConstants t(*o.circuit, light.lux);
  const double photocurrent = o.circuit->photocurrent_fa_per_lux * light.lux,
               modulation = light.modulation * photocurrent / (photocurrent + o.circuit->dark_current_fa),
               rate = 2 * std::numbers::pi * light.frequency_hz,
               h = 1 / std::sqrt((1 + std::pow(rate * t.photodiode, 2)) * (1 + std::pow(rate * t.follower, 2))),
               swing = 2 * std::atanh(modulation * h), threshold = 0.5 * (o.threshold_on() + o.threshold_off()),
               beyond = swing - threshold, reached = 0.5 * (beyond + std::hypot(beyond, kSoft * threshold)),
               missed = 2e-6 * light.frequency_hz * swing * o.refractory_period_us;
  return {reached / (o.threshold_on() + missed), reached / (o.threshold_off() + missed)};
}

std::vector<bool> every_pixel(const std::vector<PixelCounts>& recordings) {
  return std::vector<bool>(recordings.front().pixels.size(), true);
}

}  // namespace

double CircuitModel::value(const EventCameraOptions& o, Index k) {
  switch (k) {
    case kOn:
      return o.threshold_on();
    case kOff:
      return o.threshold_off();
    case kPhotocurrent:
      return o.circuit->photocurrent_fa_per_lux;
    case kFollower:
      return o.circuit->source_follower_hz;
    case kCharge:
      return o.circuit->photodiode_charge_e;
    default:
      return o.circuit->dark_current_fa;
  }
}

CircuitModel::CircuitModel(EventCameraOptions sensor, std::vector<Index> parameters,
                           const std::vector<PixelCounts>& recordings, VectorXd recorded)
    : base_(std::move(sensor)), free_(std::move(parameters)), used_(recordings), recorded_(std::move(recorded)) {
  for (const PixelCounts& r : used_) numbers_of_lamps_ += r.light.flickers() ? 2 : 0;
}

EventCameraOptions CircuitModel::sensor_at(const VectorXd& p) const {
  EventCameraOptions o = base_;
  for (std::size_t k = 0; k < free_.size(); ++k) set_value(o, free_[k], std::exp(p[static_cast<Eigen::Index>(k)]));
  return o;
}

VectorXd CircuitModel::approximate(const VectorXd& p) const {
  const EventCameraOptions o = sensor_at(p);
  VectorXd all(recorded_.size());
  Eigen::Index k = 0;
  for (const PixelCounts& r : used_) {
    if (r.light.flickers()) {
      const auto [on, off] = events_of_lamp(o, r.light);
      all[k] = on, all[k + 1] = off;
      k += 2;
    } else {
      all[k++] = std::log(std::max(1e-12, 0.5 * noise_rate_hz(o, r.light.lux)));
    }
  }
  return all;
}

std::vector<CountMoments> CircuitModel::simulate(const std::vector<VectorXd>& points,
                                                 const std::vector<std::uint64_t>& seeds, const Effort& effort) const {
  const std::size_t n = used_.size();
  std::vector<std::vector<PixelCounts>> counts(points.size(), std::vector<PixelCounts>(n));
  const Workers workers(0);
  workers.for_each(static_cast<int>(points.size() * n), [&](int task) {
    const std::size_t i = static_cast<std::size_t>(task) / n, k = static_cast<std::size_t>(task) % n;
    const EventCameraOptions o = sensor_at(points[i]);
    counts[i][k] = used_[k].light.flickers() ? simulate_lamp(o, k, effort, seeds[i])
                                             : simulate_noise(o, k, effort.noise_side, seeds[i] + k + 1);
  });
  std::vector<CountMoments> moments;
  for (const auto& recordings : counts) moments.push_back(join(recordings));
  return moments;
}

PixelCounts CircuitModel::simulate_lamp(const EventCameraOptions& o, std::size_t recording, const Effort& effort,
                                        std::uint64_t seed) const {
  const KnownLight& light = used_[recording].light;
  const Eigen::Index k = first_number(recording);
  const double events = recorded_[k] + recorded_[k + 1];  // in a period
  const double response = TimeConstants(*o.circuit, light.lux).latency_s() * light.frequency_hz;
  const double settling =
      std::clamp(std::ceil(std::max(kSettlingEvents / events, 4 * response)), kMinPeriods, kMaxPeriods);
  const double extent = std::clamp(std::ceil(kLampEvents / events), kMinPeriods, kMaxPeriods);
  return simulate_counts(o, light, settling, extent, effort.lamp_side, seed, effort.points);
}

PixelCounts CircuitModel::simulate_noise(const EventCameraOptions& o, std::size_t recording, int side,
                                         std::uint64_t seed) const {
  const double off_hz = std::exp(recorded_[first_number(recording)]);
  return simulate_counts(o, used_[recording].light, std::min(kLongest_s, kSettlingNoise / off_hz),
                         std::min(kLongest_s, kNoiseEvents / off_hz), side, seed);
}

/// The moments of lamps and of constant light, whose pixels are others.
CountMoments CircuitModel::join(const std::vector<PixelCounts>& recordings) const {
  const Eigen::Index all = recorded_.size();
  CountMoments joined{VectorXd(all), MatrixXd::Zero(all, all), 0};
  Eigen::Index first = 0;
  const auto add = [&](const std::vector<PixelCounts>& part) {
    const CountMoments moments = count_moments(part, every_pixel(part));
    const Eigen::Index size = moments.mean.size();
    joined.mean.segment(first, size) = moments.mean;
    joined.covariance.block(first, first, size, size) = moments.covariance;
    first += size;
  };
  const auto lamps =
      std::find_if(recordings.begin(), recordings.end(), [](const PixelCounts& r) { return !r.light.flickers(); });
  if (lamps != recordings.begin()) add({recordings.begin(), lamps});
  for (auto one = lamps; one != recordings.end(); ++one) add({*one});
  return joined;
}

Eigen::Index CircuitModel::first_number(std::size_t recording) const {
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < recording; ++k) first += used_[k].light.flickers() ? 2 : 1;
  return first;
}

}  // namespace esim::inline fit

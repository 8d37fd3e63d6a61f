#include "esim/fit/simulated/simulation_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "esim/compare/likeness.h"
#include "esim/fit/sensor_fit.h"
#include "esim/fit/simulated/coupling_match.h"
#include "esim/fit/simulated/readout_search.h"

namespace esim::inline fit {
namespace {

constexpr std::uint64_t kFewestOfPolarity = 100;  // events
constexpr std::uint64_t kFewestIntervals = 500;
constexpr std::uint64_t kFewestQuiet = 20;  // events in quiet areas
constexpr int kMostSteps = 12;
constexpr double kClose = 0.004;         // relative distance of matched numbers
constexpr double kNear = 0.05;           // the same, to average over
constexpr double kCloseCoupling = 0.1;   // change of the logarithm of the coupling
constexpr double kChange = 1.15;         // of a parameter, for derivatives
constexpr double kWidestInterval = 0.5;  // half a 95 % interval, in units of the logarithm
constexpr double kMaxExcess = 3;  // simulated events in quiet areas, in recorded ones, if the simulated scene is wrong

/// What the thresholds and the refractory period are matched to.
struct Moments {
  double on = 0, off = 0;  ///< events
  double shortest_us = 0;  ///< 1 % of the intervals

  explicit Moments(const SensorStatistics& s)
      : on(static_cast<double>(s.on)),
        off(static_cast<double>(s.events - s.on)),
        shortest_us(s.intervals_us.quantile(0.01)) {}

  Eigen::Vector3d logarithms() const { return {std::log(on), std::log(off), std::log(shortest_us)}; }
  bool enough() const { return std::min(on, off) >= static_cast<double>(kFewestOfPolarity); }
};

class ClipFitter {
 public:
  ClipFitter(const EventCameraOptions& base, const ClipStatistics& real, const SimulatedClip& simulate)
      : base_(base),
        real_(real.sensor),
        target_(real.sensor),
        simulate_(simulate),
        fit_{base, {}},
        coupling_(real.bursts, fit_.options) {}

  SimulationFit run() {
    if (!target_.enough()) {
      const std::string why = fmt::format("the recording has {} ON and {} OFF events; {} of each are necessary",
                                          real_.on, real_.events - real_.on, kFewestOfPolarity);
      for (const char* name : {"contrast_threshold_on", "contrast_threshold_off", "refractory_period_us",
                               "leak_rate_hz", "circuit.frame_coupling", "readout.time_stamp_us", "readout.row_wait_us",
                               "readout.row_time_us", "readout.column_coupling"})
        unknown(name, "", why);
      fit_.options = base_;
      return std::move(fit_);
    }
    allow_rate();
    find_leak();
    match();
    find_readout();
    match();
    find_intervals();
    fit_.estimates.push_back(coupling_.finish(fit_.options, trouble_));
    return std::move(fit_);
  }

 private:
  ClipStatistics simulate(const EventCameraOptions& options) {
    ++fit_.simulations;
    return simulate_(options);
  }
  void unknown(const char* name, const char* unit, const std::string& why) {
    fit_.estimates.push_back(Estimate::unknown(name, unit, why));
  }

  /// A readout that is slower than the recording is not the sensor's.
  void allow_rate() {
    constexpr double kReserve = 1.25;
    std::uint64_t most = 0;
    for (const StreamSums& block : real_.blocks) most = std::max(most, block.events);
    ReadoutOptions& readout = fit_.options.readout;
    const double peak_mev_per_s = real_.block_s > 0 ? 1e-6 * static_cast<double>(most) / real_.block_s : 0;
    if (readout.rate_mev_per_s <= 0) return;
    if (readout.rate_mev_per_s > kReserve * peak_mev_per_s) {
      unknown("readout.rate_mev_per_s", "Mev/s",
              fmt::format("the recording has at most {:.3g} Mev/s, which do not show the limit", peak_mev_per_s));
      return;
    }
    readout.rate_mev_per_s = 0;
    unknown("readout.rate_mev_per_s", "Mev/s",
            fmt::format("the recording has {:.3g} Mev/s, so that the limit of the base does not hold; none is set",
                        peak_mev_per_s));
  }

  /// The reference of a pixel in a quiet area is anywhere between its thresholds since the last motion, with equal
  /// probability. Until its first event, a leak of the rate r thus makes r C+ / (C+ + C-) events per second.
  void find_leak() {
    const QuietAreas::Block& quiet = real_.quiet.all;
    if (quiet.events < kFewestQuiet) {
      unknown(
          "leak_rate_hz", "Hz",
          fmt::format("areas without motion have {} events; at least {} are necessary", quiet.events, kFewestQuiet));
      return;
    }
    leak_events_ = static_cast<double>(quiet.events);
    leak_quiet_hz_ = real_.quiet.rate_hz();
  }

  void set_leak() {
    if (leak_quiet_hz_ <= 0) return;
    EventCameraOptions& o = fit_.options;
    const auto mean_of = [](double decades) {  // of a log-normal distribution with median 1
      const double s = decades * std::numbers::ln10;
      return std::exp(0.5 * s * s);
    };
    const double first = o.circuit ? 1 + o.threshold_off() / o.threshold_on() : 1;
    const double hot_decades = o.circuit ? o.circuit->hot_mismatch_decades : o.leak_mismatch_decades;
    const double hot_hz = o.hot_pixels * o.hot_pixel_rate_hz * mean_of(hot_decades);
    const auto leak = [&](double quiet_hz) {
      return std::max(0.0, (quiet_hz * first - hot_hz) / ((1 - o.hot_pixels) * mean_of(o.leak_mismatch_decades)));
    };
    const double reach = kNormalQuantile / std::sqrt(leak_events_);
    o.leak_rate_hz = leak(leak_quiet_hz_);
    leak_ = Estimate::found("leak_rate_hz", "Hz", o.leak_rate_hz, leak(leak_quiet_hz_ * std::max(0.0, 1 - reach)),
                            leak(leak_quiet_hz_ * (1 + reach)), "areas without motion");
  }

  /// Numbers of events are about inversely proportional to thresholds, since each event adds one to the reference.
  void match() {
    // No interval of a pixel is shorter than its refractory period.
    const double longest_us = real_.intervals_us.quantile(0.001);
    const bool intervals = real_.intervals_us.total() >= kFewestIntervals;
    for (int step = 0; step < kMostSteps; ++step) {
      set_leak();
      EventCameraOptions& o = fit_.options;
      const ClipStatistics simulated = simulate(o);
      const Moments found(simulated.sensor);
      if (!found.enough()) {
        o = base_;
        trouble_ = fmt::format("the simulated sensor has {} ON and {} OFF events", found.on, found.off);
        return;
      }
      const double on = found.on / target_.on, off = found.off / target_.off;
      const double missing_us = intervals ? target_.shortest_us - found.shortest_us : 0;
      const double before_us = o.refractory_period_us,
                   refractory_us = std::clamp(before_us + missing_us, 0.0, longest_us);
      const double distance =
          std::max({std::abs(on - 1), std::abs(off - 1), std::abs(refractory_us - before_us) / target_.shortest_us});
      const double factor = coupling_.step(o, simulated.bursts, distance < kNear);
      if (distance < kClose && std::abs(std::log(factor)) < kCloseCoupling) break;
      const double c_on = o.threshold_on() * on, c_off = o.threshold_off() * off;
      o.contrast_threshold_on = c_on, o.contrast_threshold_off = c_off;
      o.refractory_period_us = refractory_us;
      check(o);
    }
  }

  void find_readout() {
    if (!trouble_.empty()) return;
    ReadoutSearch search(real_, [&](const EventCameraOptions& o) { return simulate(o).sensor; });
    search.run(fit_.options);
    for (Estimate& e : search.take_estimates()) fit_.estimates.push_back(std::move(e));
  }

  /// The covariance of the parameters from that of the matched numbers, by derivatives of the simulation.
  void find_intervals() {
    const auto fail = [&](const std::string& why) {
      trouble_ = why;
      unknown("contrast_threshold_on", "", why);
      unknown("contrast_threshold_off", "", why);
      unknown("refractory_period_us", "us", why);
    };
    if (!trouble_.empty()) return fail(trouble_);
    const EventCameraOptions& o = fit_.options;
    const SensorStatistics at = simulate(o).sensor;
    const double excess = at.quiet.rate_hz() / real_.quiet.rate_hz();
    if (leak_quiet_hz_ > 0 && excess > kMaxExcess) {
      fit_.options.contrast_threshold_on = base_.threshold_on();
      fit_.options.contrast_threshold_off = base_.threshold_off();
      fit_.options.refractory_period_us = base_.refractory_period_us;
      return fail(
          fmt::format("areas without motion have {:.3g} times as many events in the simulation, so that its images "
                      "are not those of the scene",
                      excess));
    }
    const Eigen::Vector3d here = Moments(at).logarithms();
    Eigen::Matrix3d slopes;
    // Without a refractory period, its derivative is one-sided.
    const double step_us = std::max(o.refractory_period_us, 0.1 * target_.shortest_us) * (kChange - 1);
    for (int k = 0; k < 3; ++k) {
      EventCameraOptions changed = o;
      if (k == 0)
        changed.contrast_threshold_on = o.threshold_on() * kChange, changed.contrast_threshold_off = o.threshold_off();
      if (k == 1)
        changed.contrast_threshold_on = o.threshold_on(), changed.contrast_threshold_off = o.threshold_off() * kChange;
      if (k == 2) changed.refractory_period_us += step_us;
      slopes.col(k) = (Moments(simulate(changed).sensor).logarithms() - here) / std::log(kChange);
    }
    const Eigen::Vector3d scatter = scatter_of_moments(at);
    const Eigen::Matrix3d inverse = slopes.inverse();
    const Eigen::Vector3d deviation = (inverse * scatter.asDiagonal()).rowwise().norm();
    add_interval("contrast_threshold_on", "", o.threshold_on(), deviation[0]);
    add_interval("contrast_threshold_off", "", o.threshold_off(), deviation[1]);
    add_refractory(deviation[2] * step_us / std::log(kChange), Moments(at).shortest_us);
    if (leak_) fit_.estimates.push_back(*leak_);
  }

  /// Standard deviations of the logarithms of the moments, by resampling the recording and the simulation.
  Eigen::Vector3d scatter_of_moments(const SensorStatistics& simulated) const {
    double rate = 0, on = 0, shortest = 0;
    for (const ComparedStatistic& s : compare_sensors(real_, simulated)) {
      if (s.name == kEventRate) rate = std::log(s.high / s.low);
      if (s.name == kOnFraction) on = s.high - s.low;
      if (s.name == kShortIntervals) shortest = std::log(s.high / s.low);
    }
    const double part = real_.on_fraction();
    const Eigen::Vector3d widths(std::hypot(rate, on / part), std::hypot(rate, on / (1 - part)), shortest);
    return widths / (2 * kNormalQuantile);
  }

  void add_interval(const char* name, const char* unit, double value, double deviation) {
    const double reach = kNormalQuantile * deviation;
    if (!(reach < kWidestInterval))
      return unknown(name, unit, "the numbers of events depend too little on it, or vary too much");
    fit_.estimates.push_back(Estimate::found(name, unit, value, value * std::exp(-reach), value * std::exp(reach),
                                             "simulation of the scene"));
  }

  void add_refractory(double deviation_us, double shortest_us) {
    const double value_us = fit_.options.refractory_period_us, reach_us = kNormalQuantile * deviation_us;
    const char* const name = "refractory_period_us";
    const auto give_up = [&](const std::string& why) {
      fit_.options.refractory_period_us = base_.refractory_period_us;
      unknown(name, "us", why);
    };
    if (real_.intervals_us.total() < kFewestIntervals)
      return give_up(fmt::format("only {} pairs of events of a pixel; at least {} are necessary",
                                 real_.intervals_us.total(), kFewestIntervals));
    if (std::abs(std::log(shortest_us / target_.shortest_us)) > 0.1)
      return give_up(
          fmt::format("1 % of the simulated intervals are below {:.4g} us whatever it is, of the recorded "
                      "ones below {:.4g} us",
                      shortest_us, target_.shortest_us));
    if (value_us <= 0)
      return give_up(fmt::format("the simulated intervals are not too short without one; it is at most {:.4g} us",
                                 real_.intervals_us.quantile(0.001)));
    if (!(reach_us < std::max(value_us, 0.25 * target_.shortest_us)))
      return give_up("the short intervals depend too little on it");
    fit_.estimates.push_back(Estimate::found(name, "us", value_us, std::max(0.0, value_us - reach_us),
                                             value_us + reach_us, "1 % of the intervals, by simulation of the scene"));
  }

  const EventCameraOptions& base_;
  const SensorStatistics& real_;
  Moments target_;
  const SimulatedClip& simulate_;
  SimulationFit fit_;
  CouplingMatch coupling_;
  std::string trouble_;  // why the sensor was not fitted
  double leak_events_ = 0, leak_quiet_hz_ = 0;
  std::optional<Estimate> leak_;
};

}  // namespace

SimulationFit fit_by_simulation(const EventCameraOptions& base, const ClipStatistics& real,
                                const SimulatedClip& simulate) {
  return ClipFitter(base, real, simulate).run();
}

std::string describe(const SimulationFit& fit) {
  SensorFit sensor;
  sensor.estimates = fit.estimates;
  return describe(sensor);
}

}  // namespace esim::inline fit

#include "esim/fit/circuit/circuit_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "esim/fit/circuit/circuit_model.h"
#include "esim/fit/circuit/circuit_simulation.h"
#include "esim/fit/circuit/circuit_solver.h"
#include "esim/fit/circuit/count_moments.h"
#include "esim/fit/circuit/least_squares.h"
#include "esim/fit/jackknife.h"

namespace esim::inline fit {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;
using enum CircuitModel::Index;
using ModelIndex = CircuitModel::Index;

constexpr double kWidest = 0.7;          // half a 95 % interval, in units of the logarithm: a factor of 2
constexpr double kUnknownDeviation = 3;  // standard deviation of the logarithm of a parameter before the fit
constexpr double kFullReadout = 0.5;     // part of the readout's rate above which it delays and loses events
constexpr double kBusy = 0.5;            // part of the time in the refractory period, above which it hides the circuit
constexpr double kFewestPerPeriod = 0.99;  // events of each polarity: pixels with fewer settle slowly
constexpr double kStrange = 4;             // standard deviations of the sum of squares
constexpr double kImpossible = 10;         // standard deviations of the recordings

struct Parameter {
  const char* name;
  const char* unit;
};
constexpr std::array<Parameter, CircuitModel::kParameters> kNames{{{"contrast_threshold_on", ""},
                                                                   {"contrast_threshold_off", ""},
                                                                   {"circuit.photocurrent_fa_per_lux", "fA/lux"},
                                                                   {"circuit.source_follower_hz", "Hz"},
                                                                   {"circuit.photodiode_charge_e", "electrons"},
                                                                   {"circuit.dark_current_fa", "fA"}}};

/// ON or OFF events of a pixel in a period of a lamp, whichever are fewer, of the pixels that have events.
double fewest_per_period(const PixelCounts& lamp) {
  double on = 0, off = 0, pixels = 0;
  for (const PixelCounts::Pixel& p : lamp.pixels.pixels()) on += p.on, off += p.off, pixels += p.on + p.off > 0 ? 1 : 0;
  return pixels > 0 ? std::min(on, off) / (pixels * lamp.extent) : 0;
}

class CircuitFitter {
 public:
  explicit CircuitFitter(const CircuitInput& input) : input_(input), base_(input.base) {}

  CircuitFit run() {
    plan();
    if (!free_.empty()) {
      base_ = on_bench(base_);
      usable_ = usable_pixels(used_);
      areas_ = means_without_areas(used_, usable_);
      if (areas_.size() < static_cast<std::size_t>(kFewestAreas)) {
        reasons_.fill("fewer than 10 of the 8 x 8 areas of the sensor have usable pixels");
      } else {
        solve();
      }
    }
    report();
    return std::move(fit_);
  }

 private:
  // What can be fitted.

  /// Why a recording cannot be used.
  std::string problem_of(const PixelCounts& recording) const {
    if (!recording.problem.empty()) return recording.problem;
    if (recording.light.flickers()) {
      if (const double fewest = fewest_per_period(recording); fewest < kFewestPerPeriod)
        return fmt::format(
            "the pixels make {:.2g} events of a polarity in a period, so that it matters how long the lamp has "
            "been on; at least one is necessary: reduce the frequency, or increase modulation or light",
            fewest);
    } else {
      if (base_.circuit->noise <= 0) return "the noise of the base is 0";
      if (!(recording.extent > 0)) return "the recording has no duration";
    }
    const double limit_hz = 1e6 * base_.readout.rate_mev_per_s;
    if (limit_hz > 0 && recording.peak_hz > kFullReadout * limit_hz)
      return fmt::format(
          "{:.3g} Mev/s{}, but the readout of the base reads {:.3g} Mev/s at most; record a small region of interest",
          1e-6 * recording.peak_hz, recording.light.flickers() ? " in a part of the period" : "",
          base_.readout.rate_mev_per_s);
    const double busy = 1e-6 * recording.rate_hz() * base_.refractory_period_us;
    if (busy > kBusy)
      return fmt::format(
          "the pixels are in their refractory period of {:.0f} us for {:.0f} % of the time; {}, or shorten the "
          "refractory period",
          base_.refractory_period_us, 100 * busy,
          recording.light.flickers() ? "reduce the modulation of the lamp" : "raise the thresholds");
    return "";
  }

  void plan() {
    if (!base_.circuit) return reasons_.fill("the base has no circuit; choose a preset with one, such as davis346");
    std::string lamp_problem, noise_problem;
    std::set<double> frequencies, levels, noise_levels;
    bool lamps_given = false;
    for (const PixelCounts& r : input_.recordings) {
      lamps_given = lamps_given || r.light.flickers();
      const std::string why = problem_of(r);
      std::string& first = r.light.flickers() ? lamp_problem : noise_problem;
      if (!why.empty()) {
        const std::string problem = fmt::format("{}: {}", r.name(), why);
        fit_.notes.push_back("circuit: not used: " + problem);
        if (first.empty()) first = problem;
        continue;
      }
      used_.push_back(r);
      if (r.light.flickers()) {
        frequencies.insert(r.light.frequency_hz), levels.insert(r.light.lux);
      } else {
        noise_levels.insert(r.light.lux);
      }
    }
    std::stable_partition(used_.begin(), used_.end(), [](const PixelCounts& r) { return r.light.flickers(); });
    const bool lamps = frequencies.size() >= 2;
    if (!lamps) {
      std::erase_if(used_, [](const PixelCounts& r) { return r.light.flickers(); });
      const std::string why = !lamps_given ? "no recording of a flickering lamp"
                              : lamp_problem.empty()
                                  ? "recordings of a lamp at two frequencies, at least, are necessary"
                                  : lamp_problem;
      for (const ModelIndex k : {kOn, kOff, kPhotocurrent, kFollower}) reasons_[k] = why;
    } else if (levels.size() < 2) {
      for (const ModelIndex k : {kPhotocurrent, kFollower})
        reasons_[k] = "lamps at one light level do not tell which of the two time constants is the photodiode's";
    }
    const auto need = [&](ModelIndex k, std::size_t count) {
      if (noise_levels.size() >= count) {
        reasons_[k].clear();
        return true;
      }
      if (reasons_[k].empty() || (k == kFollower && !lamps_given))
        reasons_[k] = !noise_problem.empty() ? noise_problem
                      : noise_levels.empty()
                          ? "no recording in constant light of known illuminance"
                          : fmt::format("constant light at {} different illuminance{}; {} are necessary",
                                        noise_levels.size(), noise_levels.size() == 1 ? "" : "s", count);
      return false;
    };
    known_thresholds_ = input_.on && input_.off;
    if (lamps || (known_thresholds_ && !noise_levels.empty())) free_.insert(free_.end(), {kOn, kOff});
    if (lamps) free_.insert(free_.end(), {kPhotocurrent, kFollower});
    has_lamps_ = lamps;
    if (need(kCharge, 1)) free_.push_back(kCharge);
    if (!lamps && need(kFollower, 2)) {
      free_.push_back(kFollower);
      // Its intervals contain the truth too rarely.
      reasons_[kFollower] =
          "constant light alone tells it unreliably; record a lamp at two frequencies and two illuminances";
    }
    if (need(kDark, lamps ? 2 : 3)) free_.push_back(kDark);
    if (used_.empty()) free_.clear();
  }

  CircuitTarget target() const {
    const auto size = static_cast<Eigen::Index>(free_.size());
    CircuitTarget t{count_moments(used_, usable_), areas_, VectorXd(size), VectorXd(), VectorXd::Zero(size)};
    for (Eigen::Index k = 0; k < size; ++k) {
      const ModelIndex index = free_[static_cast<std::size_t>(k)];
      t.start[k] = std::log(CircuitModel::value(base_, index));
      if (index > kOff || !known_thresholds_) continue;
      const Estimate& known = index == kOn ? *input_.on : *input_.off;
      t.start[k] = std::log(known.value);
      t.known_precision[k] = std::pow(2 * kNormalQuantile / std::log(known.high / known.low), 2);
    }
    t.precision = t.known_precision.array() + 1 / (kUnknownDeviation * kUnknownDeviation);
    t.grid = has_lamps_ && reasons_[kFollower].empty();
    return t;
  }

  /// Parameters that were excluded keep their own reason.
  void give_up(const std::string& why) {
    for (std::string& reason : reasons_) {
      if (reason.empty()) reason = why;
    }
  }

  void solve() {
    CircuitTarget target = this->target();
    model_.emplace(base_, free_, used_, target.recorded.mean);
    // The errors of the simulations of different sensors are independent.
    std::uint64_t seed = 0;
    for (const PixelCounts& r : used_) {
      for (const PixelCounts::Pixel& pixel : r.pixels.pixels()) seed = 31 * seed + pixel.on + pixel.off;
    }
    solutions_ = CircuitSolver(*model_, std::move(target), seed, input_.progress).solve();
    quantile_ = student_quantile(static_cast<double>(areas_.size()) - 1);
    const CircuitSolution& best = solutions_.front();
    const double times = std::sqrt(best.excess());
    if (times > kImpossible) {
      return give_up(fmt::format(
          "no sensor of this kind was found whose numbers of events agree: they differ by {:.2g} times their errors; "
          "check frequency, modulation and illuminance of each recording",
          times));
    }
    if (!best.found) {
      return give_up(
          "the search did not end at one sensor; add a lamp at another frequency and illuminance, or record longer");
    }
    if (best.degrees <= 0 || best.squares <= best.degrees + kStrange * std::sqrt(2 * best.degrees)) return;
    for (CircuitSolution& solution : solutions_) solution.covariance *= best.excess();
    fit_.notes.push_back(
        fmt::format("circuit: the model does not describe these recordings: the numbers of events differ from those of "
                    "the fitted sensor by {:.2g} times their errors. The intervals are as many times wider. Check "
                    "frequency, modulation, illuminance, and that the light is even and sinusoidal",
                    times));
  }

  // Reports.

  void report() {
    for (std::size_t i = 0; i < CircuitModel::kParameters; ++i) {
      const auto index = static_cast<ModelIndex>(i);
      if (index <= kOff && known_thresholds_) continue;
      if (reasons_[i].empty() && (solutions_.empty() || std::find(free_.begin(), free_.end(), index) == free_.end()))
        reasons_[i] = "no recording tells it";
      const auto [name, unit] = kNames[i];
      fit_.estimates.push_back(reasons_[i].empty()
                                   ? estimate(name, unit, source_of(index), 1, value_of(model_->place(index)))
                                   : Estimate::unknown(name, unit, reasons_[i]));
    }
    if (has_lamps_ && !solutions_.empty() && reasons_[kOn].empty()) observe();
  }

  /// The logarithm of a quantity and its standard deviation in a solution.
  struct Found {
    double logarithm, deviation;
  };
  using Quantity = std::function<Found(const CircuitSolution&)>;

  static Quantity value_of(Eigen::Index place) {
    return [place](const CircuitSolution& s) { return Found{s.at[place], std::sqrt(s.covariance(place, place))}; };
  }

  /// `scale` times a quantity, in all solutions.
  Estimate estimate(const std::string& name, const char* unit, const char* source, double scale,
                    const Quantity& quantity) const {
    const Found best = quantity(solutions_.front());
    double low = best.logarithm - quantile_ * best.deviation, high = best.logarithm + quantile_ * best.deviation;
    if (!(high - low < 2 * kWidest))
      return Estimate::unknown(name, unit, "the numbers of events depend too little on it in these recordings");
    for (const CircuitSolution& solution : solutions_) {
      const Found other = quantity(solution);
      const double reach = quantile_ * other.deviation;
      if (other.logarithm - reach > high || other.logarithm + reach < low) {
        return Estimate::unknown(
            name, unit,
            fmt::format("two sensors agree with these recordings, with {:.4g} and {:.4g}; add a lamp at another "
                        "frequency and illuminance",
                        scale * std::exp(best.logarithm), scale * std::exp(other.logarithm)));
      }
    }
    for (const CircuitSolution& solution : solutions_) {
      const Found other = quantity(solution);
      low = std::min(low, other.logarithm - quantile_ * other.deviation);
      high = std::max(high, other.logarithm + quantile_ * other.deviation);
    }
    return Estimate::found(name, unit, scale * std::exp(best.logarithm), scale * std::exp(low), scale * std::exp(high),
                           source);
  }

  const char* source_of(ModelIndex k) const {
    if (k == kCharge || k == kDark || !has_lamps_) return "noise in known light, by simulation";
    return "events of a lamp, by simulation";
  }

  /// Latency and bandwidth at each light level of the lamps.
  void observe() {
    std::set<double> levels;
    for (const PixelCounts& r : used_) {
      if (r.light.flickers()) levels.insert(r.light.lux);
    }
    for (const double lux : levels) {
      const auto add = [&](const char* what, const char* unit, double (TimeConstants::*value)() const, double scale) {
        const Residuals logarithm = [&](const VectorXd& p) {
          return VectorXd::Constant(1, std::log((TimeConstants(*model_->sensor_at(p).circuit, lux).*value)()));
        };
        const Estimate e =
            estimate(fmt::format("{} of small signals at {:.4g} lux", what, lux), unit, source_of(kFollower), scale,
                     [&](const CircuitSolution& s) {
                       const MatrixXd slope = slopes_at(logarithm, s.at, 1e-3);
                       return Found{logarithm(s.at)[0], std::sqrt((slope * s.covariance * slope.transpose())(0, 0))};
                     });
        if (e.determined()) fit_.observations.push_back(e);
      };
      add("latency", "us", &TimeConstants::latency_s, 1e6);
      add("bandwidth", "Hz", &TimeConstants::bandwidth_hz, 1);
    }
  }

  const CircuitInput& input_;
  EventCameraOptions base_;
  std::vector<PixelCounts> used_;
  std::array<std::string, CircuitModel::kParameters> reasons_;  // why a parameter is not determined
  std::vector<ModelIndex> free_;
  bool known_thresholds_ = false, has_lamps_ = false;
  std::vector<bool> usable_;
  std::vector<VectorXd> areas_;
  std::optional<CircuitModel> model_;
  std::vector<CircuitSolution> solutions_;  // the best first
  double quantile_ = 0;
  CircuitFit fit_;
};

}  // namespace

CircuitFit fit_circuit(const CircuitInput& input) { return CircuitFitter(input).run(); }

}  // namespace esim::inline fit

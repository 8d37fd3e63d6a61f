#include "esim/fit/sensor_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <set>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/fit/background_fit.h"
#include "esim/fit/circuit/circuit_fit.h"
#include "esim/fit/contrast_fit.h"
#include "esim/fit/image_stream.h"
#include "esim/fit/row_wait.h"
#include "esim/fit/shortest_intervals.h"
#include "esim/formats/events_file.h"
#include "esim/formats/formats.h"
#include "esim/stats/sensor/sensor_statistics.h"

namespace esim::inline fit {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPortion = std::size_t{1} << 18;
constexpr std::uint64_t kForReadout = 10'000'000;  // events of a recording from which the readout is found
constexpr std::uint64_t kFewestForReadout = 1000;
constexpr double kSmallestUnit_us = 0.1;  // finer time stamps are not rounded
constexpr TimeNs kRounding = 10;          // of seconds as text, in double precision
constexpr double kCircuitWork = 2;        // reading a recording is 1
constexpr double kClearRows = 3;          // over chance
constexpr double kClearScan = 0.9;        // concentration

struct Interrupted {};

class SensorFitter {
 public:
  SensorFitter(const FitInput& input, const FitOptions& options) : input_(input), options_(options) {
    base_ = preset_options(options.base);
    fit_.base = options.base;
    work_ = static_cast<double>(2 * input.moving.size() + input.constant.size() + input.flicker.size() +
                                input.other.size());
    if (work_ == 0) throw UserError("there is nothing to fit to; give recordings of the sensor");
    fits_circuit_ = !input.flicker.empty() ||
                    std::any_of(input.constant.begin(), input.constant.end(),
                                [](const LitRecording& recording) { return !std::isnan(recording.light.lux); });
    if (fits_circuit_) work_ += kCircuitWork;
    check_lights();
  }

  SensorFit run() {
    for (const LitRecording& recording : input_.constant) read_constant(recording);
    for (const LitRecording& recording : input_.flicker) read_flicker(recording);
    for (const fs::path& path : input_.moving) read_other(path, "moving");
    for (const fs::path& path : input_.other) read_other(path, "other");
    find_refractory();
    for (const fs::path& path : input_.moving) read_moving(path);
    find_thresholds();
    find_circuit();
    find_background();
    find_readout();
    return std::move(fit_);
  }

 private:
  ReadOptions read_options() const { return {input_.sensor, {}}; }

  /// NaN is unknown.
  void check_lights() const {
    std::set<fs::path> paths;
    const auto check = [&](const LitRecording& recording, bool flickers) {
      const auto& [lux, frequency_hz, modulation] = recording.light;
      const auto fail = [&](const std::string& what) { throw UserError(recording.path.string() + ": " + what); };
      if (!paths.insert(recording.path).second) fail("is given twice; give each recording in known light once");
      if (flickers ? lux <= 0 : lux < 0)
        fail(fmt::format("the illuminance must be {}, not {} lux", flickers ? "above 0" : "0 or more", lux));
      if (!std::isnan(lux) && !std::isfinite(lux)) fail("the illuminance must be finite");
      if (!flickers) return;
      if (!(frequency_hz > 0 && std::isfinite(frequency_hz)))
        fail(fmt::format("the frequency of the lamp must be above 0, not {} Hz", frequency_hz));
      if (modulation <= 0 || modulation >= 1)
        fail(fmt::format("the modulation of the lamp must be above 0 and below 1, not {}", modulation));
    };
    for (const LitRecording& recording : input_.constant) check(recording, false);
    for (const LitRecording& recording : input_.flicker) check(recording, true);
  }

  /// The size of the sensor, which all recordings must have.
  SensorSize size_of(const fs::path& path, std::optional<SensorSize> size) {
    if (!size || size->width < 1 || size->height < 1)
      throw RemediableError(path.string() + ": contains no size of the sensor; state it", Remedy::sensor_size);
    if (fit_.sensor.width == 0) fit_.sensor = *size;
    if (size->width != fit_.sensor.width || size->height != fit_.sensor.height) {
      throw UserError(fmt::format("{}: a sensor of {} x {} px, but the recordings before have {} x {} px",
                                  path.string(), size->width, size->height, fit_.sensor.width, fit_.sensor.height));
    }
    if (!intervals_) intervals_.emplace(size->width, size->height);
    return *size;
  }

  /// `part` of this recording has been read.
  void show(const fs::path& path, double part) {
    if (options_.progress && !options_.progress(std::min(1.0, (done_ + part) / work_), path.filename().string()))
      throw Interrupted();
  }

  /// Passes the events of a recording to `add`, in portions, and to the estimates that need nothing else.
  template <typename Add>
  FittedRecording read_events(EventsFile& file, const fs::path& path, const char* use, const Add& add) {
    FittedRecording recording{path.string(), use};
    SensorStatisticsCounter readout(fit_.sensor);
    std::vector<Event> events;
    std::optional<TimeNs> first;
    TimeNs last = 0;
    while (file.read(events, kPortion)) {
      show(path, file.progress());
      if (events.empty()) continue;
      if (!first) first = events.front().t;
      last = events.back().t;
      intervals_->add(events);
      if (recording.events < kForReadout) readout.add(events);
      recording.events += events.size();
      for (const Event& event : events) {
        const TimeNs rest = event.t % kNsPerUs;
        in_us_ += std::min(std::abs(rest), kNsPerUs - std::abs(rest)) <= kRounding;
      }
      add(events);
    }
    intervals_->end_recording();
    if (first) recording.duration_s = to_seconds(last - *first);
    readouts_.push_back(std::move(readout).finish());
    done_ += 1;
    return recording;
  }

  void read_constant(const LitRecording& constant) {
    const fs::path& path = constant.path;
    EventsFile file(path, read_options());
    const SensorSize size = size_of(path, file.sensor());
    BackgroundFit background(size.width, size.height);
    const bool known = !std::isnan(constant.light.lux);
    PixelCounter counter(constant.light, size.width, size.height);
    FittedRecording recording = read_events(file, path, "static", [&](EventSpan events) {
      background.add(events);
      if (known) counter.add(events);
    });
    const RecordingInfo info = open_source(path, read_options())->info();
    if (info.start_known && info.end > info.start) recording.duration_s = to_seconds(info.end - info.start);
    fit_.recordings.push_back(recording);
    constant_.push_back({std::move(background), recording.duration_s});
    if (known) add_counts(counter, recording);
  }

  void read_flicker(const LitRecording& flicker) {
    EventsFile file(flicker.path, read_options());
    const SensorSize size = size_of(flicker.path, file.sensor());
    PixelCounter counter(flicker.light, size.width, size.height);
    const FittedRecording recording =
        read_events(file, flicker.path, "flicker", [&](EventSpan events) { counter.add(events); });
    fit_.recordings.push_back(recording);
    add_counts(counter, recording);
  }

  void add_counts(const PixelCounter& counter, const FittedRecording& recording) {
    counts_.push_back(counter.finish(recording.duration_s));
    counts_.back().file = fs::path(recording.path).filename().string();
  }

  void read_other(const fs::path& path, const char* use) {
    EventsFile file(path, read_options());
    size_of(path, file.sensor());
    fit_.recordings.push_back(read_events(file, path, use, [](EventSpan) {}));
  }

  /// The leak from the recording with the least noise.
  void read_leak(double ratio) {
    background_.reset(), noisiest_.reset();
    for (const Constant& constant : constant_) {
      if (constant.duration_s <= 0) continue;
      const BackgroundFit::Result result = constant.background.finish(constant.duration_s, ratio);
      if (!background_ || result.off_hz < background_->off_hz) background_ = result;
      if (!noisiest_ || result.off_hz > noisiest_->off_hz) noisiest_ = result;
    }
  }

  /// The refractory period is known by now.
  void read_moving(const fs::path& path) {
    EventsFile file(path, read_options());
    if (!contrast_) {
      contrast_.emplace(fit_.sensor.width, fit_.sensor.height,
                        ContrastFit::Options{refractory_s_, base_.dark_light(), options_.find_offset});
    }
    ImageStream images(path, read_options());
    std::uint64_t count = 0;
    std::vector<Event> waiting, events;  // for their image
    bool more = true;
    while (images.next()) {
      show(path, images.progress());
      while (more && (waiting.empty() || waiting.back().t <= images.time())) {
        more = file.read(events, kPortion);
        if (more) waiting.insert(waiting.end(), events.begin(), events.end());
      }
      const auto end = std::upper_bound(waiting.begin(), waiting.end(), images.time(),
                                        [](TimeNs t, const Event& event) { return t < event.t; });
      contrast_->add(images.time(), images.image(),
                     EventSpan(waiting).first(static_cast<std::size_t>(end - waiting.begin())));
      waiting.erase(waiting.begin(), end);
      ++count;
    }
    contrast_->end_recording();
    for (FittedRecording& recording : fit_.recordings) {
      if (recording.path == path.string() && recording.use == "moving") recording.images = count;
    }
    if (count < 2)
      fit_.notes.push_back(fmt::format("{}: {} images; it determines no thresholds", path.string(), count));
    done_ += 1;
  }

  void add(const Estimate& e) { fit_.estimates.push_back(e); }

  void find_thresholds() {
    if (!contrast_) {
      const char* const why = "no recording of a moving scene with images";
      if (input_.flicker.empty()) {
        for (const char* name : {"contrast_threshold_on", "contrast_threshold_off"})
          add(Estimate::unknown(name, "", why));
      }
      add(Estimate::unknown("threshold_mismatch", "", why));
      if (base_.circuit) add(Estimate::unknown("circuit.threshold_mismatch_common", "", why));
      add(Estimate::unknown("dead_pixels", "", why));
      return;
    }
    thresholds_ = contrast_->finish();
    if (input_.flicker.empty() || thresholds_->on.determined()) {
      add(thresholds_->on);
      add(thresholds_->off);
    }
    Estimate mismatch = thresholds_->mismatch;
    if (!base_.circuit && mismatch.determined()) {  // without a circuit, the thresholds share no part
      const double mean = 0.5 * (thresholds_->on.value + thresholds_->off.value);
      const auto whole = [&](double own, double common) { return std::hypot(own, mean * common); };
      const Estimate& common = thresholds_->common;
      if (common.low > 0) {
        mismatch.value = whole(mismatch.value, common.value);
        mismatch.low = whole(mismatch.low, common.low), mismatch.high = whole(mismatch.high, common.high);
        fit_.notes.push_back(
            "ON and OFF thresholds of a pixel deviate together, which only sensors with a circuit do: "
            "threshold_mismatch contains both; choose a base with a circuit");
      }
    }
    add(mismatch);
    if (base_.circuit) add(thresholds_->common);
    add(thresholds_->dead);
    fit_.observations.push_back(thresholds_->delay);
    if (options_.find_offset) fit_.observations.push_back(thresholds_->offset);
    if (thresholds_->on.determined()) {
      fit_.distributions.push_back(thresholds_->pixels_on);
      fit_.distributions.push_back(thresholds_->pixels_off);
      fit_.notes.push_back(
          fmt::format("thresholds: {} equations, residual {:.3g} ln; the events explain {:.1f} % of the "
                      "changes of brightness in the images",
                      thresholds_->equations, thresholds_->residual, 100 * thresholds_->explained));
    }
  }

  /// What the recordings have determined so far, and the base in the rest.
  EventCameraOptions known_sensor() const {
    EventCameraOptions sensor = base_;
    for (const Estimate& e : fit_.estimates) {
      if (!e.determined()) continue;
      if (e.name == "contrast_threshold_on") sensor.contrast_threshold_on = e.value;
      if (e.name == "contrast_threshold_off") sensor.contrast_threshold_off = e.value;
      if (e.name == "threshold_mismatch") sensor.threshold_mismatch = e.value;
      if (e.name == "refractory_period_us") sensor.refractory_period_us = e.value;
      if (sensor.circuit && e.name == "circuit.threshold_mismatch_common")
        sensor.circuit->threshold_mismatch_common = e.value;
    }
    return sensor;
  }

  /// The circuit from lamps and from noise at known illuminances.
  void find_circuit() {
    if (!fits_circuit_) return;
    CircuitInput input{known_sensor(), counts_};
    if (thresholds_ && thresholds_->on.determined()) input.on = thresholds_->on, input.off = thresholds_->off;
    read_leak(input.base.threshold_off() / input.base.threshold_on());
    if (background_ && background_->leak_rate.determined()) input.base.leak_rate_hz = background_->leak_rate.value;
    input.progress = [&](double part) { show("simulation of the circuit", kCircuitWork * part); };
    const CircuitFit found = fit_circuit(input);
    done_ += kCircuitWork;
    const auto known = [&, before = fit_.estimates](const Estimate& e) {
      return std::any_of(before.begin(), before.end(), [&](const Estimate& other) { return other.name == e.name; });
    };
    std::copy_if(found.estimates.begin(), found.estimates.end(), std::back_inserter(fit_.estimates),
                 std::not_fn(known));
    fit_.observations.insert(fit_.observations.end(), found.observations.begin(), found.observations.end());
    fit_.notes.insert(fit_.notes.end(), found.notes.begin(), found.notes.end());
  }

  void find_background() {
    const EventCameraOptions sensor = known_sensor();
    read_leak(sensor.threshold_off() / sensor.threshold_on());
    if (!background_) {
      const char* const why =
          constant_.empty() ? "no recording in constant light" : "the recordings in constant light have no duration";
      for (const auto& [name, unit] : {std::pair{"leak_rate_hz", "Hz"},
                                       {"leak_mismatch_decades", ""},
                                       {"hot_pixels", ""},
                                       {"hot_pixel_rate_hz", "Hz"}})
        add(Estimate::unknown(name, unit, why));
      if (!base_.circuit) add(Estimate::unknown("shot_noise_hz", "Hz", why));
      return;
    }
    add(background_->leak_rate);
    add(background_->leak_decades);
    if (!base_.circuit) add(background_->leak_jitter);
    add(background_->hot_pixels);
    add(background_->hot_rate);
    if (base_.circuit) add(background_->hot_decades);
    if (!base_.circuit) {
      add(noisiest_->noise);
    } else {
      fit_.notes.push_back(fmt::format(
          "noise: {:.3g} Hz OFF events of a pixel{}", noisiest_->off_hz,
          fits_circuit_ ? ""
                        : "; the noise of the circuit is that of " + fit_.base + ", since no illuminance is stated"));
    }
    if (!background_->leak.values.empty()) fit_.distributions.push_back(background_->leak);
  }

  void find_refractory() {
    TimeNs unit = std::numeric_limits<TimeNs>::max();
    for (const SensorStatistics& s : readouts_) {
      if (s.stamp_unit > 0) unit = std::min(unit, s.stamp_unit);
    }
    if (unit == std::numeric_limits<TimeNs>::max()) unit = 1;
    std::uint64_t events = 0;
    for (const FittedRecording& recording : fit_.recordings) events += recording.events;
    if (unit < kNsPerUs && events > 0 && in_us_ == events) unit = kNsPerUs;
    stamp_unit_ = unit;
    const ShortestIntervals::Result shortest = intervals_->finish(unit);
    const Estimate& found = shortest.refractory;
    add(found);
    // The shortest interval is an upper limit, and mostly near.
    refractory_s_ = 1e-6 * (found.determined()                 ? found.value
                            : std::isnan(shortest.shortest_us) ? 0.0
                                                               : shortest.shortest_us);
    if (!found.determined()) return;
    const double low = found.value, high = shortest.intervals_us.back();
    if (high > low) {  // not if all are 0, as with several events of a pixel in one time stamp
      FittedDistribution d;
      d.title = "Shortest intervals of the pixels", d.axis = "interval (us)", d.values = shortest.intervals_us;
      d.density = [low, high](double x) { return x < low || x > high ? 0.0 : 1 / (high - low); };
      fit_.distributions.push_back(std::move(d));
    }
  }

  void find_readout() {
    const SensorStatistics* busiest = nullptr;
    for (const SensorStatistics& s : readouts_) {
      if (busiest == nullptr || s.events > busiest->events) busiest = &s;
    }
    if (busiest == nullptr || busiest->events < kFewestForReadout) {
      add(Estimate::unknown("readout.time_stamp_us", "us", fmt::format("fewer than {} events", kFewestForReadout)));
      return;
    }
    const double unit_us = 1e-3 * static_cast<double>(stamp_unit_);
    if (base_.circuit) {
      const double rounded_us = unit_us >= kSmallestUnit_us ? unit_us : 0;
      add(Estimate::found("readout.time_stamp_us", "us", rounded_us, rounded_us, rounded_us, "time stamps"));
    }
    if (busiest->scan && busiest->scan->concentration > kClearScan) {
      // The phase is known to a part of the period in the whole recording.
      const double period_us = 1e6 * busiest->scan->period_s,
                   error_us = period_us * busiest->scan->period_s / std::max(1e-3, busiest->duration_s);
      const Estimate period = Estimate::found("readout.scan_period_us", "us", period_us, period_us - error_us,
                                              period_us + error_us, "time stamps of the columns");
      base_.circuit ? add(period) : fit_.observations.push_back(period);
    }
    if (const std::optional<Estimate> wait = find_row_wait(*busiest))
      base_.circuit ? add(*wait) : fit_.observations.push_back(*wait);
    const double rows = busiest->same_us.row_over_chance(fit_.sensor.height);
    if (rows > kClearRows) {
      fit_.notes.push_back(
          fmt::format("readout: events of a row share a time stamp {:.3g} times more often than by "
                      "chance, as of sensors that read whole rows",
                      rows));
    }
  }

  struct Constant {
    BackgroundFit background;
    double duration_s;
  };

  const FitInput& input_;
  const FitOptions& options_;
  EventCameraOptions base_;
  SensorFit fit_;
  double work_ = 0, done_ = 0;
  bool fits_circuit_ = false;
  std::vector<Constant> constant_;
  std::vector<PixelCounts> counts_;  // in known light
  std::optional<ContrastFit> contrast_;
  std::optional<ShortestIntervals> intervals_;
  std::vector<SensorStatistics> readouts_;
  std::optional<BackgroundFit::Result> background_, noisiest_;
  std::optional<ContrastFit::Result> thresholds_;
  TimeNs stamp_unit_ = 1;
  std::uint64_t in_us_ = 0;  // events with time stamps in whole us, but for rounding
  double refractory_s_ = 0;  // as far as known
};

}  // namespace

std::optional<SensorFit> fit_sensor(const FitInput& input, const FitOptions& options) {
  try {
    return SensorFitter(input, options).run();
  } catch (const Interrupted&) {
    return std::nullopt;
  }
}

}  // namespace esim::inline fit

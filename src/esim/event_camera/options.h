#pragma once

#include <algorithm>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/describe.h"
#include "esim/filters/options.h"

namespace esim::inline event_camera {

/// A sensor with published parameters and the version of these (docs/methods/presets.md).
struct SensorPreset {
  std::string sensor = "ideal";
  int version = 0;  ///< 1: separate effects; 2: by the circuit; 0: the sensor has no versions

  bool operator==(const SensorPreset&) const = default;

  /// As scenarios write it: "davis346@2".
  std::string name() const;

  /// All valid names. A name without a version means the newest one; it comes before those with versions.
  static std::vector<std::string> names();

  /// The preset of a name, if there is one.
  static std::optional<SensorPreset> find(std::string_view name);

  /// "davis346 has the versions 1 and 2" for the name of a sensor with another version; otherwise empty.
  static std::string problem(std::string_view name);
};

/// How irradiance becomes brightness.
enum class PixelResponse {
  log,      ///< L = ln(E + log_eps), as in the paper
  lin_log,  ///< L = ln(255 E), linear through the origin below lin_log_knee, as in v2e
};

/// What happens to events within a refractory period.
enum class RefractoryMode {
  hold,  ///< the pixel is held in reset; its reference is the brightness at the period's end, as in real sensors
  drop,  ///< the events are lost, but they update the reference, as in the original ESIM
};

/// The readout of the pixels. Rows with events wait, first come first served, for one reader, which reads all events of
/// a row together and stamps them with the time of reading. A pixel waits until its event has been read; then its
/// refractory period begins.
struct ReadoutOptions {
  double rate_mev_per_s = 0.0;
  double row_time_us = 0.0;
  int queue_events = 0;
  double row_wait_us = 0.0;
  double column_coupling = 0.0;
  double scan_period_us = 0.0;
  bool scan_hold = false;
  double time_stamp_us = 0.0;

  static constexpr double kRowsOfDoubleWait = 16;  ///< rows that wait when a row waits for 2 row_wait_us

  bool limited() const { return rate_mev_per_s > 0 || row_time_us > 0; }
  /// Whether the pixels wait for it.
  bool acknowledges() const { return limited() || row_wait_us > 0 || scan_period_us > 0 || time_stamp_us > 0; }
};

/// The circuit of the pixels before their comparators: photodiode, photoreceptor and source follower, with the shot
/// noise of the photocurrent (docs/methods/circuit.md). It replaces log_eps, dark_irradiance, the low-pass, shot noise,
/// threshold noise and latency, all of which follow from it.
struct CircuitOptions {
  std::optional<double> white_lux{};  ///< unset: kUsualWhiteLux
  double f_number = 2.0;
  double transmission = 0.9;
  double photocurrent_fa_per_lux = 10.0;
  double dark_current_fa = 1.0;
  double photodiode_charge_e = 600.0;
  double source_follower_hz = 200.0;
  double high_pass_hz = 0.0;
  double leak_hz_per_klux = 0.0;
  double noise = 1.0;
  double frame_coupling = 0.0;
  std::optional<double> frame_rate_hz{};      ///< unset: kUsualFrameRate_hz
  std::optional<double> frame_exposure_ms{};  ///< unset: kUsualFrameExposure_ms
  double frame_offset_ms = 0.0;

  double threshold_mismatch_common = 0.0;
  double noise_mismatch_decades = 0.0;
  double refractory_mismatch_decades = 0.0;
  double hot_mismatch_decades = 0.7;
  double hot_off_fraction = 0.0;
  double max_rate_hz = 0.0;

  static constexpr double kUsualWhiteLux = 1000;
  static constexpr double kUsualFrameRate_hz = 22.7, kUsualFrameExposure_ms = 6;  // of the Event Camera Dataset
  static constexpr double kElementaryCharge_fC = 1.602176634e-4;                  ///< fA s

  /// The illuminance of a pixel that sees a diffuse white surface at irradiance 1, lux.
  double white_sensor_lux() const {
    return white_lux.value_or(kUsualWhiteLux) * transmission / (4 * f_number * f_number);
  }
  /// The photocurrent of such a pixel, fA.
  double white_photocurrent_fa() const { return photocurrent_fa_per_lux * white_sensor_lux(); }
  /// The time constants of the photodiode at a photocurrent, dark current included, and of the source follower, s.
  double photodiode_s(double current_fa) const { return photodiode_charge_e * kElementaryCharge_fC / current_fa; }
  double source_follower_s() const { return 1 / (2 * std::numbers::pi * source_follower_hz); }
  /// The period and the exposure of the frames that disturb the pixels, ms.
  double frame_period_ms() const { return 1e3 / frame_rate_hz.value_or(kUsualFrameRate_hz); }
  double exposure_ms() const { return frame_exposure_ms.value_or(kUsualFrameExposure_ms); }
  /// The dark current in units of the irradiance: L = ln(E + this), plus a constant.
  double dark_irradiance() const { return dark_current_fa / white_photocurrent_fa(); }
};

/// Parameters of an event camera. Thresholds are changes of brightness, in natural logarithms. Effects that depend on
/// the irradiance use the relative intensity i = (E + dark_irradiance) / (1 + dark_irradiance), which is 1 at white.
struct EventCameraOptions {
  SensorPreset preset{};

  double contrast_threshold = 0.5;
  std::optional<double> contrast_threshold_on{};   ///< C+; default: contrast_threshold
  std::optional<double> contrast_threshold_off{};  ///< C-; default: contrast_threshold
  double threshold_ratio = 1.0;                    ///< C- / C+, unless C- is given
  double threshold_mismatch = 0.0;
  double threshold_noise = 0.0;

  PixelResponse response = PixelResponse::log;
  double log_eps = 0.001;
  double lin_log_knee = 20.0 / 255.0;
  double dark_irradiance = 20.0 / 255.0;
  double low_pass_hz = 0.0;
  int low_pass_order = 1;
  double surround_px = 0.0;
  double surround_ms = 0.0;

  double refractory_period_us = 0.0;
  RefractoryMode refractory_mode = RefractoryMode::hold;

  double leak_rate_hz = 0.0;
  double leak_mismatch_decades = 0.0;
  double leak_jitter = 0.0;
  double shot_noise_hz = 0.0;
  double shot_noise_at_white = 0.25;
  double hot_pixels = 0.0;
  double hot_pixel_rate_hz = 100.0;
  double dead_pixels = 0.0;

  double latency_us = 0.0;
  double latency_jitter_us = 0.0;
  double latency_light_share = 0.0;
  ReadoutOptions readout{};
  std::optional<CircuitOptions> circuit{};
  FilterOptions filters{};

  bool labels = false;

  /// What is added to the irradiance before the logarithm.
  double dark_light() const { return circuit ? circuit->dark_irradiance() : log_eps; }
  double threshold_on() const { return contrast_threshold_on.value_or(contrast_threshold); }
  double threshold_off() const { return contrast_threshold_off.value_or(threshold_ratio * contrast_threshold); }

  /// The smaller of the two, C of Eq. 2: what tolerances of sampling are multiples of.
  double min_threshold() const { return std::min(threshold_on(), threshold_off()); }
};

/// Throws UserError if options contradict each other, or if a value of the circuit or of the readout is out of range.
void check(const EventCameraOptions& options);

/// Minimum threshold of any pixel, whatever the noise: keeps the number of events per step finite.
inline constexpr double kMinContrastThreshold = 0.01;

/// The parameters of a sensor. Throws UserError if there is no such preset.
EventCameraOptions preset_options(const SensorPreset& preset);

/// The same by name, such as "davis346" or "davis346@1".
EventCameraOptions preset_options(std::string_view name);

}  // namespace esim::inline event_camera

namespace esim {

template <>
inline constexpr std::array<const char*, 2> kEnumNames<PixelResponse>{"log", "lin_log"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<RefractoryMode>{"hold", "drop"};

}  // namespace esim

namespace esim::inline event_camera {

template <class Visitor>
void describe(Visitor& visit, ReadoutOptions& o) {
  visit("rate_mev_per_s", o.rate_mev_per_s, About{"maximum readout rate; 0: no limit", "Mev/s", 0, 1e6});
  visit("row_time_us", o.row_time_us, About{"time to read out a row, in addition to its events", "us", 0, 1e6});
  visit(
      "queue_events", o.queue_events,
      About{"maximum number of waiting events; further events are dropped and counted; 0: one per pixel", "", 0, 1e9});
  visit("row_wait_us", o.row_wait_us,
        About{"with circuit: mean time from the first request of a row until it is read, if no other row waits", "us",
              0, 1e6});
  visit("column_coupling", o.column_coupling,
        About{"with circuit: probability with which an event that is read calls the rows of ON events that wait in its "
              "column",
              "", 0, 1});
  visit("scan_period_us", o.scan_period_us,
        About{"with circuit: period in which all columns are read one after the other; 0: rows are read on request",
              "us", 0, 1e6});
  visit("scan_hold", o.scan_hold, About{"whether a scan reports only events from before it began"});
  visit("time_stamp_us", o.time_stamp_us,
        About{"with circuit: time stamps are rounded up to multiples of this; 0: to 1 ns", "us", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, CircuitOptions& o) {
  visit(
      "white_lux", o.white_lux,
      About{"illuminance of a diffuse white surface at irradiance 1 (default: light.white_lux)", "lux", 0, 1e9, true});
  visit("f_number", o.f_number, About{"f-number of the lens", "", 0.1, 100});
  visit("transmission", o.transmission, About{"fraction of the light that the lens transmits", "", 0, 1, true});
  visit("photocurrent_fa_per_lux", o.photocurrent_fa_per_lux,
        About{"photocurrent of a pixel per illuminance of the sensor", "fA/lux", 0, 1e9, true});
  visit("dark_current_fa", o.dark_current_fa, About{"dark current of a pixel", "fA", 1e-9, 1e9});
  visit(
      "photodiode_charge_e", o.photodiode_charge_e,
      About{"charge that moves the photoreceptor by a factor of e: sets noise and time constant", "electrons", 1, 1e9});
  visit("source_follower_hz", o.source_follower_hz,
        About{"cut-off (-3 dB) of the source follower", "Hz", 0, 1e9, true});
  visit("high_pass_hz", o.high_pass_hz,
        About{"cut-off (-3 dB) of the high-pass before the comparators; 0: no high-pass", "Hz", 0, 1e6});
  visit("leak_hz_per_klux", o.leak_hz_per_klux,
        About{"leak that light adds to leak_rate_hz, per 1000 lux on the sensor", "Hz", 0, 1e6});
  visit("noise", o.noise, About{"factor on the standard deviation of the noise; 0: no noise", "", 0, 10});
  visit("frame_coupling", o.frame_coupling,
        About{"what the exposure of frames on the same chip subtracts from the comparators' input", "", -1, 1});
  visit("frame_rate_hz", o.frame_rate_hz,
        About{"rate of these frames (default: that of frame_camera; without one: 22.7)", "Hz", 0.01, 1e4});
  visit("frame_exposure_ms", o.frame_exposure_ms,
        About{"their exposure (default: exposure_s of frame_camera; without one: 6)", "ms", 0.2, 1e5});
  visit("frame_offset_ms", o.frame_offset_ms,
        About{"middle of one of their exposures, after the start of the simulation", "ms", 0, 1e6});
  visit("threshold_mismatch_common", o.threshold_mismatch_common,
        About{"relative standard deviation, from pixel to pixel, that both thresholds share", "", 0, 1});
  visit("noise_mismatch_decades", o.noise_mismatch_decades,
        About{"standard deviation of log10 of the noise from pixel to pixel", "", 0, 1});
  visit("refractory_mismatch_decades", o.refractory_mismatch_decades,
        About{"standard deviation of log10 of the refractory period from pixel to pixel", "", 0, 1});
  visit("hot_mismatch_decades", o.hot_mismatch_decades,
        About{"standard deviation of log10 of the hot pixels' leak", "", 0, 2});
  visit("hot_off_fraction", o.hot_off_fraction, About{"fraction of hot pixels that leak downwards", "", 0, 1});
  visit("max_rate_hz", o.max_rate_hz,
        About{"maximum rate of events of a pixel; the others are lost and counted; 0: 10 kHz if the noise reaches the "
              "thresholds and neither a refractory period nor the readout limits the rate, otherwise no maximum",
              "Hz", 0, 1e9});
}

template <class Visitor>
void describe(Visitor& visit, EventCameraOptions& o) {
  // A preset sets all values that are not given explicitly.
  const SensorPreset before = o.preset;
  visit("preset", o.preset,
        About{"sensor that sets the defaults of all other options; NAME is the newest version, NAME@1 the older one by "
              "separate effects"});
  if (o.preset != before) o = preset_options(o.preset);

  visit("contrast_threshold", o.contrast_threshold,
        About{"change of log-brightness that fires an event", "", 0.01, 100});
  visit("contrast_threshold_on", o.contrast_threshold_on,
        About{"the same for ON events, C+ (default: contrast_threshold)", "", 0.01, 100});
  visit("contrast_threshold_off", o.contrast_threshold_off,
        About{"the same for OFF events, C- (default: contrast_threshold times threshold_ratio)", "", 0.01, 100});
  visit("threshold_ratio", o.threshold_ratio, About{"C- / C+, if contrast_threshold_off is not given", "", 0.01, 100});
  visit("threshold_mismatch", o.threshold_mismatch,
        About{"standard deviation of the thresholds from pixel to pixel, fixed in time", "", 0, 10});
  visit("threshold_noise", o.threshold_noise,
        About{"standard deviation of a pixel's thresholds from event to event (sigma_C)", "", 0, 10});

  visit("response", o.response, About{"brightness: ln(E + log_eps), or v2e's with a linear toe"});
  visit("log_eps", o.log_eps, About{"added to the irradiance before the logarithm", "", 0, 1, true});
  visit("lin_log_knee", o.lin_log_knee, About{"irradiance below which lin_log is linear", "", 0.005, 10});
  visit(
      "dark_irradiance", o.dark_irradiance,
      About{"irradiance equivalent to the dark current; effects that depend on the irradiance E use E plus this value",
            "", 0, 10, true});
  visit("low_pass_hz", o.low_pass_hz,
        About{"cut-off (-3 dB) of the photoreceptor at white; 0: no low-pass", "Hz", 0, 1e9});
  visit("low_pass_order", o.low_pass_order, About{"poles of the photoreceptor's low-pass", "", 1, 2});
  visit("surround_px", o.surround_px,
        About{"length constant of the surround that is subtracted from each pixel; 0: no surround", "px", 0, 1000});
  visit("surround_ms", o.surround_ms, About{"time constant of the surround", "ms", 0, 1e6});

  visit("refractory_period_us", o.refractory_period_us,
        About{"time after an event during which a pixel fires no events", "us", 0, 1e9});
  visit("refractory_mode", o.refractory_mode, About{"hold: the pixel is held in reset; drop: its events are dropped"});
  visit("leak_rate_hz", o.leak_rate_hz, About{"rate of ON events of a pixel at constant irradiance", "Hz", 0, 1e6});
  visit("leak_mismatch_decades", o.leak_mismatch_decades,
        About{"standard deviation of log10 of the leak rate from pixel to pixel", "", 0, 2});
  visit("leak_jitter", o.leak_jitter, About{"relative standard deviation of the time between leak events", "", 0, 0.3});
  visit("shot_noise_hz", o.shot_noise_hz,
        About{"rate of random events of a pixel in the dark, ON and OFF", "Hz", 0, 1e5});
  visit("shot_noise_at_white", o.shot_noise_at_white,
        About{"fraction of the shot noise that remains at white", "", 0, 1});
  visit("hot_pixels", o.hot_pixels, About{"fraction of pixels that leak at hot_pixel_rate_hz", "", 0, 1});
  visit("hot_pixel_rate_hz", o.hot_pixel_rate_hz, About{"rate of ON events of a hot pixel", "Hz", 0, 1e6});
  visit("dead_pixels", o.dead_pixels, About{"fraction of pixels that never fire", "", 0, 1});

  visit("latency_us", o.latency_us,
        About{"time from the threshold crossing to the time stamp, at white", "us", 0, 1e6});
  visit("latency_jitter_us", o.latency_jitter_us, About{"standard deviation of the latency, at white", "us", 0, 1e6});
  visit("latency_light_share", o.latency_light_share,
        About{"fraction of latency and jitter that is proportional to 1 / intensity", "", 0, 1});
  visit("readout", o.readout, About{"readout of the events from the pixels"});
  visit(
      "circuit", o.circuit,
      About{"simulates the pixels' circuit, from light in lux, with its noise (default: none, but the effects above)"});
  visit("labels", o.labels, About{"explains each event: its cause, its ideal time, and the object that the pixel saw"});
  visit("filters", o.filters,
        About{"digital filters behind the readout, in the order in which events pass them (default: none)"});
}

}  // namespace esim::inline event_camera

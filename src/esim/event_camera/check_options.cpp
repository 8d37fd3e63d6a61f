#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "esim/core/error.h"
#include "esim/event_camera/circuit/frame_coupling.h"
#include "esim/event_camera/options.h"

namespace esim::inline event_camera {
namespace {

/// A visitor of describe() that throws UserError for numbers out of range.
class RangeCheck {
 public:
  explicit RangeCheck(std::string where) : where_(std::move(where)) {}

  void operator()(const char* name, double value, const About& about) const {
    if (std::isfinite(value) && value <= about.max && (about.above_min ? value > about.min : value >= about.min))
      return;
    throw UserError(fmt::format("event camera: {}.{} = {}; it must be {} {:g} and at most {:g}", where_, name, value,
                                about.above_min ? "above" : "at least", about.min, about.max));
  }
  void operator()(const char* name, const std::optional<double>& value, const About& about) const {
    if (value) (*this)(name, *value, about);
  }
  template <typename T>
  requires std::is_integral_v<T>
  void operator()(const char*, T, const About&) const {}

 private:
  std::string where_;
};

template <typename Options>
void check_ranges(const char* where, Options options) {
  RangeCheck visitor(where);
  describe(visitor, options);
}

void refuse_without_circuit(const char* name, double value) {
  if (value == 0) return;
  throw UserError(
      fmt::format("event camera: readout.{} = {:.6g} needs circuit; set circuit, or remove it", name, value));
}

}  // namespace

void check(const EventCameraOptions& o) {
  check_ranges("readout", o.readout);
  if (!o.circuit) {
    refuse_without_circuit("row_wait_us", o.readout.row_wait_us);
    refuse_without_circuit("column_coupling", o.readout.column_coupling);
    refuse_without_circuit("scan_period_us", o.readout.scan_period_us);
    refuse_without_circuit("time_stamp_us", o.readout.time_stamp_us);
    return;
  }
  check_ranges("circuit", *o.circuit);
  if (o.circuit->high_pass_hz > 0.5 * o.circuit->source_follower_hz) {
    throw UserError(
        fmt::format("event camera: circuit.high_pass_hz = {:.6g}, but it must be at most half of "
                    "circuit.source_follower_hz = {:.6g}; lower it",
                    o.circuit->high_pass_hz, o.circuit->source_follower_hz));
  }
  const double period_ms = o.circuit->frame_period_ms(), exposure_ms = o.circuit->exposure_ms();
  const double longest_ms = period_ms - 2e-6 * static_cast<double>(FrameCoupling::kRise);
  if (o.circuit->frame_coupling != 0 && exposure_ms > longest_ms) {
    throw UserError(fmt::format(
        "event camera: circuit.frame_exposure_ms = {:.6g}, but at circuit.frame_rate_hz = {:.6g} it must be "
        "at most {:.6g}; lower one of them",
        exposure_ms, 1e3 / period_ms, longest_ms));
  }
  const std::string older = SensorPreset::find(o.preset.sensor + "@1") ? o.preset.sensor + "@1" : "";
  const std::string remedy = older.empty() ? "remove it" : "remove it, or choose preset " + older;
  const auto refuse = [&](const char* name, double value) {
    if (value == 0) return;
    throw UserError(fmt::format("event camera: {} = {:.6g}, but with circuit this follows from the circuit; {}", name,
                                value, remedy));
  };
  refuse("threshold_noise", o.threshold_noise);
  refuse("low_pass_hz", o.low_pass_hz);
  refuse("surround_px", o.surround_px);
  refuse("leak_jitter", o.leak_jitter);
  refuse("shot_noise_hz", o.shot_noise_hz);
  refuse("latency_us", o.latency_us);
  refuse("latency_jitter_us", o.latency_jitter_us);
  refuse("readout.queue_events", o.readout.queue_events);  // each pixel keeps its request
  if (o.response != PixelResponse::log) throw UserError("event camera: response: circuit needs log; " + remedy);
  if (o.refractory_mode != RefractoryMode::hold)
    throw UserError("event camera: refractory_mode: circuit needs hold; " + remedy);
}

}  // namespace esim::inline event_camera

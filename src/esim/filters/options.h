#pragma once

#include <optional>
#include <string>
#include <vector>

#include "esim/core/describe.h"

namespace esim::inline filters {

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height).
struct RegionOptions {
  int x = 0, y = 0, width = 1, height = 1;
};

/// A pixel that is switched off.
struct MaskedPixelOptions {
  int x = 0, y = 0;
};

/// Which pixels may report events.
struct RegionFilterOptions {
  bool invert = false;  ///< false: only pixels inside (ROI); true: only pixels outside (RONI)
  std::vector<RegionOptions> windows{};
  std::vector<MaskedPixelOptions> masked_pixels{};
};

/// What the anti-flicker filter does with the events of flickering blocks.
enum class FlickerMode { band_stop, band_pass };

/// Drops the events of blocks of 4 x 4 pixels whose light flickers.
struct AntiFlickerOptions {
  FlickerMode mode = FlickerMode::band_stop;
  double low_hz = 50.0, high_hz = 520.0;
  int start_threshold = 6, stop_threshold = 4;
};

/// Which events of a burst pass. A burst consists of events of one pixel with the same polarity, each within the
/// threshold of the previous one.
enum class TrailType {
  trail,           ///< the first
  stc_cut_trail,   ///< the second
  stc_keep_trail,  ///< all but the first
};

/// Drops single events (noise) or the trails of edges.
struct TrailFilterOptions {
  TrailType type = TrailType::trail;
  double threshold_us = 10'000.0;
};

/// Passes all events or none, by the rate in the previous window. Rates in events per second. A bound at 0 is off; a
/// rate at which the other state returns is, if 0, the bound itself (no hysteresis).
struct ActivityFilterOptions {
  double window_us = 1'000.0;
  double lower_start = 0.0, lower_stop = 0.0;
  double upper_start = 0.0, upper_stop = 0.0;
};

/// Limits the number of events per period. The defaults are those of the IMX636: 50 million events per second.
struct RateControllerOptions {
  double period_us = 200.0;
  int events_per_period = 10'000;
};

/// The digital blocks of a sensor, in the order in which events pass them.
struct FilterOptions {
  std::optional<RegionFilterOptions> region{};
  std::optional<ActivityFilterOptions> activity{};
  std::optional<AntiFlickerOptions> anti_flicker{};
  std::optional<TrailFilterOptions> trail{};
  std::optional<RateControllerOptions> rate_controller{};

  /// Whether there is any filter.
  bool any() const { return region || activity || anti_flicker || trail || rate_controller; }
};

/// An option with an invalid value.
struct FilterProblem {
  std::string key;      ///< of the option within FilterOptions, dotted: "region.windows.0"
  std::string problem;  ///< what is wrong, and what to do
};

/// The first option that contradicts another one, or that has no effect; empty if all are valid.
std::optional<FilterProblem> find_problem(const FilterOptions& options);

/// The same for a sensor of `width` x `height` px: windows and masked pixels must not lie outside it.
std::optional<FilterProblem> find_problem(const FilterOptions& options, int width, int height);

/// Throws UserError "PREFIXKEY: PROBLEM" if there is a problem.
void refuse(const std::optional<FilterProblem>& problem, const std::string& prefix = "");

}  // namespace esim::inline filters

namespace esim {

template <>
inline constexpr std::array<const char*, 2> kEnumNames<FlickerMode>{"band_stop", "band_pass"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<TrailType>{"trail", "stc_cut_trail", "stc_keep_trail"};

}  // namespace esim

namespace esim::inline filters {

template <class Visitor>
void describe(Visitor& visit, RegionOptions& o) {
  visit("x", o.x, About{"first column", "px", 0, 65535});
  visit("y", o.y, About{"first row", "px", 0, 65535});
  visit("width", o.width, About{"number of columns", "px", 1, 65536});
  visit("height", o.height, About{"number of rows", "px", 1, 65536});
}

template <class Visitor>
void describe(Visitor& visit, MaskedPixelOptions& o) {
  visit("x", o.x, About{"column", "px", 0, 65535});
  visit("y", o.y, About{"row", "px", 0, 65535});
}

template <class Visitor>
void describe(Visitor& visit, RegionFilterOptions& o) {
  visit("invert", o.invert, About{"false: keep the events inside the windows (ROI); true: those outside (RONI)"});
  visit("windows", o.windows, About{"rectangles of pixels; none: the whole sensor"});
  visit("masked_pixels", o.masked_pixels, About{"pixels that are switched off"});
}

template <class Visitor>
void describe(Visitor& visit, AntiFlickerOptions& o) {
  visit("mode", o.mode, About{"drop the events of flickering blocks (band_stop), or keep only these (band_pass)"});
  visit("low_hz", o.low_hz, About{"minimum frequency of flicker", "Hz", 1, 5000});
  visit("high_hz", o.high_hz, About{"maximum frequency of flicker", "Hz", 1, 5000});
  visit("start_threshold", o.start_threshold,
        About{"number of periods in the band after which a block flickers", "", 1, 7});
  visit("stop_threshold", o.stop_threshold, About{"value of this count at which the flicker has ended", "", 0, 6});
}

template <class Visitor>
void describe(Visitor& visit, TrailFilterOptions& o) {
  visit("type", o.type,
        About{"events of a burst that pass: the first (trail), the second (stc_cut_trail), all but the first "
              "(stc_keep_trail)"});
  visit("threshold_us", o.threshold_us, About{"maximum time between two events of a burst", "us", 1, 1e7});
}

template <class Visitor>
void describe(Visitor& visit, ActivityFilterOptions& o) {
  visit("window_us", o.window_us, About{"time in which events are counted", "us", 1, 1e7});
  visit("lower_start", o.lower_start, About{"rate from which events pass; 0: no lower bound", "ev/s", 0, 1e12});
  visit("lower_stop", o.lower_stop, About{"rate below which they no longer pass; 0: lower_start", "ev/s", 0, 1e12});
  visit("upper_stop", o.upper_stop, About{"rate above which events are dropped; 0: no upper bound", "ev/s", 0, 1e12});
  visit("upper_start", o.upper_start, About{"rate at which they pass again; 0: upper_stop", "ev/s", 0, 1e12});
}

template <class Visitor>
void describe(Visitor& visit, RateControllerOptions& o) {
  visit("period_us", o.period_us, About{"period in which events are counted", "us", 1, 1e7});
  visit("events_per_period", o.events_per_period, About{"maximum number of events that pass in a period", "", 0, 1e9});
}

template <class Visitor>
void describe(Visitor& visit, FilterOptions& o) {
  visit("region", o.region, About{"regions of interest and masked pixels"});
  visit("activity", o.activity, About{"event rate activity filter"});
  visit("anti_flicker", o.anti_flicker, About{"anti-flicker filter"});
  visit("trail", o.trail, About{"event trail filter"});
  visit("rate_controller", o.rate_controller, About{"event rate controller"});
}

}  // namespace esim::inline filters

#include "esim/filters/filter_chain.h"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "esim/filters/activity_filter.h"
#include "esim/filters/anti_flicker_filter.h"
#include "esim/filters/rate_controller.h"
#include "esim/filters/region_filter.h"
#include "esim/filters/trail_filter.h"

namespace esim::inline filters {

void validate(const FilterOptions& options) {
  if (const auto& flicker = options.anti_flicker) {
    if (flicker->low_hz >= flicker->high_hz)
      throw UserError(fmt::format("anti_flicker.low_hz: must be below high_hz, {} Hz; it is {} Hz", flicker->high_hz,
                                  flicker->low_hz));
    if (flicker->stop_threshold >= flicker->start_threshold)
      throw UserError(fmt::format("anti_flicker.stop_threshold: must be below start_threshold, {}; it is {}",
                                  flicker->start_threshold, flicker->stop_threshold));
  }
  if (const auto& activity = options.activity) {
    if (activity->lower_start <= 0 && activity->upper_stop <= 0)
      throw UserError("activity: has no bound; set lower_start or upper_stop");
    if (activity->lower_stop > activity->lower_start)
      throw UserError(fmt::format("activity.lower_stop: must not be above lower_start, {} ev/s; it is {} ev/s",
                                  activity->lower_start, activity->lower_stop));
    if (activity->upper_start > activity->upper_stop)
      throw UserError(fmt::format("activity.upper_start: must not be above upper_stop, {} ev/s; it is {} ev/s",
                                  activity->upper_stop, activity->upper_start));
    if (activity->upper_stop > 0 && activity->lower_start >= activity->upper_stop)
      throw UserError(fmt::format("activity.upper_stop: must be above lower_start, {} ev/s; it is {} ev/s",
                                  activity->lower_start, activity->upper_stop));
  }
}

namespace {

/// Throws UserError for windows and pixels outside the sensor.
void validate(const RegionFilterOptions& region, int width, int height) {
  const auto require = [&](const char* list, std::size_t i, int x, int y) {
    if (x < width && y < height) return;
    throw UserError(
        fmt::format("region.{}.{}: ({}, {}) lies outside the sensor of {} x {} px", list, i, x, y, width, height));
  };
  for (std::size_t i = 0; i < region.windows.size(); ++i)
    require("windows", i, region.windows[i].x, region.windows[i].y);
  for (std::size_t i = 0; i < region.masked_pixels.size(); ++i)
    require("masked_pixels", i, region.masked_pixels[i].x, region.masked_pixels[i].y);
}

}  // namespace

FilterChain::FilterChain(const FilterOptions& options, int width, int height) : width_(width), height_(height) {
  filters::validate(options);
  if (options.region) validate(*options.region, width, height);
  const auto add = [&]<typename Filter>(const char* name, std::unique_ptr<Filter> filter) {
    stages_.push_back({{name, 0}, std::move(filter)});
  };
  if (options.region) add("region", std::make_unique<RegionFilter>(*options.region, width, height));
  if (options.activity) add("activity", std::make_unique<ActivityFilter>(*options.activity));
  if (options.anti_flicker)
    add("anti_flicker", std::make_unique<AntiFlickerFilter>(*options.anti_flicker, width, height));
  if (options.trail) add("trail", std::make_unique<TrailFilter>(*options.trail, width, height));
  if (options.rate_controller) add("rate_controller", std::make_unique<RateController>(*options.rate_controller));
}

void FilterChain::check(EventSpan events) const {
  constexpr TimeNs kMaxTime = std::numeric_limits<TimeNs>::max() / 2;  // differences of times stay representable
  TimeNs last = last_.value_or(-kMaxTime);
  for (const Event& event : events) {
    if (event.x >= width_ || event.y >= height_)
      throw UserError(
          fmt::format("event at t = {} ns, ({}, {}): lies outside the sensor of {} x {} px; state the size "
                      "of the sensor that recorded it",
                      event.t, event.x, event.y, width_, height_));
    if (event.t > kMaxTime || event.t < -kMaxTime)
      throw UserError(fmt::format("event at t = {} ns: the time must be within 4.6e18 ns of 0", event.t));
    if (event.t < last)
      throw UserError(
          fmt::format("event at t = {} ns: is earlier than the event before it, at {} ns; sort the events "
                      "by time",
                      event.t, last));
    last = event.t;
  }
}

void FilterChain::process(EventSpan events, std::vector<Event>& out) {
  check(events);
  if (!events.empty()) last_ = events.back().t;
  EventSpan current = events;
  for (Stage& stage : stages_) {
    output_.clear();
    stage.filter->process(current, output_);
    stage.dropped.events += current.size() - output_.size();
    std::swap(input_, output_);
    current = input_;
  }
  out.insert(out.end(), current.begin(), current.end());
}

std::vector<FilterChain::Dropped> FilterChain::dropped() const {
  std::vector<Dropped> result;
  for (const Stage& stage : stages_) result.push_back(stage.dropped);
  return result;
}

}  // namespace esim::inline filters

#include "esim/filters/filter_chain.h"

#include <fmt/format.h>

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

FilterChain::FilterChain(const FilterOptions& options, int width, int height) : width_(width), height_(height) {
  validate(options);
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

void FilterChain::process(EventSpan events, std::vector<Event>& out) {
  for (const Event& event : events) {
    if (event.x >= width_ || event.y >= height_)
      throw UserError(
          fmt::format("event at t = {} ns, ({}, {}): lies outside the sensor of {} x {} px; state the size "
                      "of the sensor that recorded it",
                      event.t, event.x, event.y, width_, height_));
  }
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

#include "esim/filters/filter_chain.h"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline filters {

FilterChain::FilterChain(const FilterOptions& options, int width, int height) : width_(width), height_(height) {
  refuse(find_problem(options, width, height));
  if (options.region) stages_.push_back({{"region", 0}, RegionFilter(*options.region, width, height)});
  if (options.activity) stages_.push_back({{"activity", 0}, ActivityFilter(*options.activity)});
  if (options.anti_flicker)
    stages_.push_back({{"anti_flicker", 0}, AntiFlickerFilter(*options.anti_flicker, width, height)});
  if (options.trail) stages_.push_back({{"trail", 0}, TrailFilter(*options.trail, width, height)});
  if (options.rate_controller) stages_.push_back({{"rate_controller", 0}, RateController(*options.rate_controller)});
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
    std::visit([&](EventFilter& filter) { filter.process(current, output_); }, stage.filter);
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

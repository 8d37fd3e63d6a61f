#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"

namespace esim::inline filters {

/// The filters of a sensor, one after the other in the order of FilterOptions: region, activity, anti-flicker, trail,
/// rate controller.
class FilterChain final : public EventFilter {
 public:
  /// For a sensor of `width` x `height` px. Throws UserError for invalid options.
  FilterChain(const FilterOptions& options, int width, int height);

  /// Throws UserError if an event lies outside the sensor.
  void process(EventSpan events, std::vector<Event>& out) override;

  /// The number of events that each filter has dropped so far, by its name.
  struct Dropped {
    std::string filter;
    std::uint64_t events = 0;
  };
  std::vector<Dropped> dropped() const;

 private:
  struct Stage {
    Dropped dropped;
    std::unique_ptr<EventFilter> filter;
  };

  int width_, height_;
  std::vector<Stage> stages_;
  std::vector<Event> input_, output_;  // of a stage
};

}  // namespace esim::inline filters

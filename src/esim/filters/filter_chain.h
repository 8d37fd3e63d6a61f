#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "esim/filters/activity_filter.h"
#include "esim/filters/anti_flicker_filter.h"
#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"
#include "esim/filters/rate_controller.h"
#include "esim/filters/region_filter.h"
#include "esim/filters/trail_filter.h"

namespace esim::inline filters {

/// The filters of a sensor, one after the other in the order of FilterOptions: region, activity, anti-flicker, trail,
/// rate controller. Its memory depends on the size of the sensor and of the largest call only.
class FilterChain final : public EventFilter {
 public:
  /// For a sensor of `width` x `height` px. Throws UserError for invalid options, and for windows and masked pixels
  /// that lie outside the sensor.
  FilterChain(const FilterOptions& options, int width, int height);

  /// Throws UserError if an event lies outside the sensor, is earlier than the previous one, or is more than 146 years
  /// from 0; then no event of the call has been processed.
  void process(EventSpan events, std::vector<Event>& out) override;

  /// The number of events that each filter has dropped so far, by its name.
  struct Dropped {
    std::string filter;
    std::uint64_t events = 0;
  };
  std::vector<Dropped> dropped() const;

  /// Saves or restores the state, for a chain that continues elsewhere. Archives have the functions of
  /// core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.last_);
    for (auto& stage : self.stages_) {
      archive.value(stage.dropped.events);
      std::visit([&]<class Filter>(Filter& filter) { Filter::transfer(archive, filter); }, stage.filter);
    }
  }

 private:
  struct Stage {
    Dropped dropped;
    std::variant<RegionFilter, ActivityFilter, AntiFlickerFilter, TrailFilter, RateController> filter;
  };

  void check(EventSpan events) const;

  int width_, height_;
  std::optional<TimeNs> last_;  // time of the last event
  std::vector<Stage> stages_;
  std::vector<Event> input_, output_;  // of a stage
};

}  // namespace esim::inline filters

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"

namespace esim::inline filters {

/// The event rate controller of Prophesee's sensors (OpenEB: I_ErcModule, with its temporal dropping). In each period
/// at most `events_per_period` events pass. If the previous period had more events, every k-th event passes, where k is
/// their number divided by this maximum, from another start in each period, so that no row or pixel has an advantage.
/// Periods start at multiples of their length.
class RateController final : public EventFilter {
 public:
  explicit RateController(const RateControllerOptions& options);

  void process(EventSpan events, std::vector<Event>& out) override;

  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.index_);
    archive.value(self.arrived_);
    archive.value(self.passed_);
    archive.value(self.expected_);
    archive.value(self.remainder_);
    archive.value(self.dropped_);
  }

  std::uint64_t dropped() const { return dropped_; }  ///< number of events so far

 private:
  TimeNs period_;
  std::int64_t limit_;
  std::optional<std::int64_t> index_;          // of the current period
  std::int64_t arrived_ = 0, passed_ = 0;      // in it
  std::int64_t expected_ = 0, remainder_ = 0;  // events expected in it; of the division, in 1/expected of an event
  std::uint64_t dropped_ = 0;
};

}  // namespace esim::inline filters

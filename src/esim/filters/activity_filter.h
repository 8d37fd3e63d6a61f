#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"

namespace esim::inline filters {

/// The event rate activity filter of Prophesee's sensors (OpenEB: I_EventRateActivityFilterModule): all events pass or
/// none, by the rate in the previous window, with hysteresis. Windows start at multiples of their length. Nothing
/// passes in the first window if there is a lower bound.
class ActivityFilter final : public EventFilter {
 public:
  explicit ActivityFilter(const ActivityFilterOptions& options);

  void process(EventSpan events, std::vector<Event>& out) override;

  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.index_);
    archive.value(self.count_);
    archive.value(self.enough_);
    archive.value(self.few_);
  }

 private:
  void end_window();

  ActivityFilterOptions options_;
  TimeNs window_;
  std::optional<std::int64_t> index_;  // of the current window
  std::int64_t count_ = 0;             // events in it
  bool enough_, few_ = true;           // above the lower bound, below the upper bound
};

}  // namespace esim::inline filters

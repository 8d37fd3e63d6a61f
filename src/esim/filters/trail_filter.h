#pragma once

#include <cstdint>
#include <vector>

#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"

namespace esim::inline filters {

/// The event trail filter of Prophesee's sensors (OpenEB: I_EventTrailFilterModule). A burst is a run of events of one
/// pixel with the same polarity, each at most the threshold after the previous one.
class TrailFilter final : public EventFilter {
 public:
  TrailFilter(const TrailFilterOptions& options, int width, int height);

  void process(EventSpan events, std::vector<Event>& out) override;

  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.fixed(self.bursts_);
  }

 private:
  struct Burst {
    TimeNs last = 0;            // time of its last event
    std::int8_t polarity = 0;   // 0: no event yet
    std::uint8_t position = 0;  // of the last event in it: 1, 2, or 3 for every later one
  };

  TrailType type_;
  TimeNs threshold_;
  std::size_t width_;
  std::vector<Burst> bursts_;
};

}  // namespace esim::inline filters

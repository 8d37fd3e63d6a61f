#pragma once

#include <cstdint>
#include <vector>

#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"

namespace esim::inline filters {

/// Regions of interest (ROI) or of no interest (RONI), and switched-off pixels. Masked pixels never pass.
class RegionFilter final : public EventFilter {
 public:
  /// For a sensor of `width` x `height` px; parts of windows outside it are ignored.
  RegionFilter(const RegionFilterOptions& options, int width, int height);

  void process(EventSpan events, std::vector<Event>& out) override;

  template <class Archive, class Self>
  static void transfer(Archive&, Self&) {}  // no state

 private:
  std::size_t width_;
  std::vector<std::uint8_t> passes_;  // one per pixel, in rows
};

}  // namespace esim::inline filters

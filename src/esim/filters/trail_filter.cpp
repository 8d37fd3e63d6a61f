#include "esim/filters/trail_filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace esim::inline filters {

TrailFilter::TrailFilter(const TrailFilterOptions& options, int width, int height)
    : type_(options.type),
      threshold_(std::llround(options.threshold_us * 1e3)),
      width_(static_cast<std::size_t>(width)),
      bursts_(width_ * static_cast<std::size_t>(height)) {}

void TrailFilter::process(EventSpan events, std::vector<Event>& out) {
  for (const Event& event : events) {
    Burst& burst = bursts_[event.y * width_ + event.x];
    const bool continues = burst.polarity == event.polarity && event.t - burst.last <= threshold_;
    burst.position = continues ? static_cast<std::uint8_t>(std::min(burst.position + 1, 3)) : 1;
    burst.polarity = event.polarity;
    burst.last = event.t;
    const bool passes = type_ == TrailType::trail           ? burst.position == 1
                        : type_ == TrailType::stc_cut_trail ? burst.position == 2
                                                            : burst.position >= 2;
    if (passes) out.push_back(event);
  }
}

}  // namespace esim::inline filters

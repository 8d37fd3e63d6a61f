#include "esim/filters/activity_filter.h"

#include <cmath>

#include "esim/filters/windows.h"

namespace esim::inline filters {

ActivityFilter::ActivityFilter(const ActivityFilterOptions& options)
    : options_(options), window_(std::llround(options.window_us * 1e3)), enough_(options.lower_start <= 0) {
  if (options_.lower_stop <= 0) options_.lower_stop = options_.lower_start;
  if (options_.upper_start <= 0) options_.upper_start = options_.upper_stop;
}

void ActivityFilter::end_window() {
  const double rate = static_cast<double>(count_) * 1e9 / static_cast<double>(window_);
  if (options_.lower_start > 0) enough_ = rate >= (enough_ ? options_.lower_stop : options_.lower_start);
  if (options_.upper_stop > 0) few_ = rate <= (few_ ? options_.upper_stop : options_.upper_start);
  count_ = 0;
}

void ActivityFilter::process(EventSpan events, std::vector<Event>& out) {
  for (const Event& event : events) {
    const std::int64_t index = window_index(event.t, window_);
    if (index_ && index > *index_) {
      end_window();
      if (index > *index_ + 1) end_window();  // an empty one between them; more of these change nothing
    }
    index_ = index;
    ++count_;
    if (enough_ && few_) out.push_back(event);
  }
}

}  // namespace esim::inline filters

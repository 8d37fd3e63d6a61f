#include "esim/sensors/readout.h"

#include <algorithm>
#include <cmath>

namespace esim {

Readout::Readout(const ReadoutOptions& options, int height)
    : ns_per_event_(options.rate_mev_per_s > 0 ? 1e3 / options.rate_mev_per_s : 0.0),
      row_ns_(options.row_time_us * 1e3),
      capacity_(static_cast<std::size_t>(options.queue_events)),
      rows_(static_cast<std::size_t>(height)) {}

/// Serves the rows whose turn comes before `now`.
void Readout::serve_until(TimeNs now, std::vector<Event>& out) {
  while (!requests_.empty()) {
    std::vector<Event>& row = rows_[requests_.front()];
    const TimeNs start = std::max(free_at_, row.front().t);
    if (start >= now) return;
    if (start > free_at_) ahead_ = 0;

    const std::size_t first = out.size();
    for (Event& event : row) event.t = start;
    out.insert(out.end(), row.begin(), row.end());
    std::sort(out.begin() + static_cast<std::ptrdiff_t>(first), out.end());
    const double events = static_cast<double>(row.size());
    const double busy_ns = std::max(row_ns_ + ns_per_event_ * events, 1.0) - ahead_;
    free_at_ = start + static_cast<TimeNs>(std::ceil(busy_ns));
    ahead_ = std::ceil(busy_ns) - busy_ns;
    waiting_ -= row.size();
    row.clear();
    requests_.pop_front();
  }
}

void Readout::advance(EventSpan events, TimeNs until, std::vector<Event>& out) {
  for (const Event& event : events) {
    serve_until(event.t, out);
    if (waiting_ == capacity_) {
      ++dropped_;
      continue;
    }
    std::vector<Event>& row = rows_[event.y];
    if (row.empty()) requests_.push_back(event.y);
    row.push_back(event);
    ++waiting_;
  }
  serve_until(until + 1, out);
}

}  // namespace esim

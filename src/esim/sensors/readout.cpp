#include "esim/sensors/readout.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace esim {

Readout::Readout(const ReadoutOptions& options, int height)
    : per_event_(options.rate_mev_per_s > 0 ? std::llround(std::ldexp(1e3 / options.rate_mev_per_s, kFineBits)) : 0),
      per_row_(std::llround(std::ldexp(options.row_time_us * 1e3, kFineBits))),
      capacity_(static_cast<std::size_t>(options.queue_events)),
      rows_(static_cast<std::size_t>(height)),
      requests_(std::bit_ceil(rows_.size())) {}

/// Serves the rows whose turn comes before `now`.
void Readout::serve_until(TimeNs now, std::vector<Event>& out) {
  constexpr FineTime kNs = FineTime{1} << kFineBits;
  while (request_count_ > 0) {
    const Request request = requests_[first_request_];
    const TimeNs free_at = (free_at_ + kNs - 1) >> kFineBits, start = std::max(free_at, request.t);
    if (start >= now) return;

    Row& row = rows_[request.row];
    const std::size_t first = out.size();
    for (std::uint32_t i = 0, slot = row.first; i < row.count; ++i) {
      out.emplace_back(start, slots_[slot].x, request.row, slots_[slot].polarity);
      const std::uint32_t next = slots_[slot].next;
      slots_[slot].next = free_slot_;
      free_slot_ = slot;
      slot = next;
    }
    if (row.count > 1) std::sort(out.begin() + static_cast<std::ptrdiff_t>(first), out.end());

    const FineTime busy = std::max(per_row_ + per_event_ * static_cast<FineTime>(row.count), kNs);
    // Fractions of a nanosecond are kept while there is always something to do.
    free_at_ = (start > free_at ? start << kFineBits : free_at_) + busy;
    waiting_ -= row.count;
    row.count = 0;
    first_request_ = (first_request_ + 1) & (requests_.size() - 1);
    --request_count_;
  }
}

void Readout::accept(const Event& event) {
  if (waiting_ == capacity_) {
    ++dropped_;
    return;
  }
  if (free_slot_ == slots_.size()) slots_.push_back({0, 0, free_slot_ + 1});
  const std::uint32_t slot = free_slot_;
  free_slot_ = slots_[slot].next;
  Row& row = rows_[event.y];
  if (row.count == 0) {
    requests_[(first_request_ + request_count_++) & (requests_.size() - 1)] = {event.t, event.y};
  }
  slots_[slot] = {event.x, event.polarity, row.first};
  row.first = slot;
  ++row.count;
  ++waiting_;
}

void Readout::advance(EventSpan events, TimeNs until, std::vector<Event>& out) {
  const std::size_t most = out.size() + events.size() + waiting_;
  if (most > out.capacity()) out.reserve(std::max(most, 2 * out.capacity()));
  for (const Event& event : events) {
    serve_until(event.t, out);
    accept(event);
  }
  serve_until(until + 1, out);
}

}  // namespace esim

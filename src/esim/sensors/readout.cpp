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

/// From `start` on, the reader is busy with a row's events.
inline void Readout::occupy(TimeNs start, std::uint32_t count) {
  const FineTime busy = std::max(per_row_ + per_event_ * static_cast<FineTime>(count), kNs);
  // Fractions of a nanosecond are kept while there is always something to do.
  free_at_ = (start > free_from() ? start << kFineBits : free_at_) + busy;
}

/// Reads out a row with several events.
void Readout::serve(const Row& row, std::uint16_t y, TimeNs t, std::vector<Event>& out) {
  const std::size_t first = out.size();
  out.push_back({t, row.x, y, row.polarity});
  for (std::uint32_t i = 1, slot = row.others; i < row.count; ++i) {
    const Slot event = slots_[slot];
    out.push_back({t, event.x, y, event.polarity});
    slots_[slot].next = free_slot_;
    free_slot_ = slot;
    slot = event.next;
  }
  std::sort(out.begin() + static_cast<std::ptrdiff_t>(first), out.end());
}

/// Serves the rows whose turn comes before `now`.
inline void Readout::serve_until(TimeNs now, std::vector<Event>& out) {
  while (request_count_ > 0) {
    const Request request = requests_[first_request_];
    const TimeNs start = std::max(free_from(), request.t);
    if (start >= now) return;
    Row& row = rows_[request.row];
    occupy(start, row.count);
    if (row.count == 1) [[likely]] {
      out.push_back({start, row.x, request.row, row.polarity});
    } else {
      serve(row, request.row, start, out);
    }
    waiting_ -= row.count;
    row.count = 0;
    first_request_ = (first_request_ + 1) & (requests_.size() - 1);
    --request_count_;
  }
}

inline void Readout::accept(const Event& event) {
  if (waiting_ == capacity_) {
    ++dropped_;
    return;
  }
  ++waiting_;
  Row& row = rows_[event.y];
  if (row.count++ == 0) [[likely]] {
    requests_[(first_request_ + request_count_++) & (requests_.size() - 1)] = {event.t, event.y};
    row.x = event.x, row.polarity = event.polarity;
    return;
  }
  if (free_slot_ == slots_.size()) slots_.push_back({0, 0, free_slot_ + 1});
  const std::uint32_t slot = free_slot_;
  free_slot_ = slots_[slot].next;
  slots_[slot] = {event.x, event.polarity, row.others};
  row.others = slot;
}

void Readout::advance(EventSpan events, TimeNs until, std::vector<Event>& out) {
  const std::size_t most = out.size() + events.size() + waiting_;
  if (most > out.capacity()) out.reserve(std::max(most, 2 * out.capacity()));
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    if (request_count_ > 0) serve_until(event.t, out);
    // Where nothing waits, and nothing comes until the reader turns to it, it does not wait in its row.
    const TimeNs start = std::max(free_from(), event.t), next = i + 1 < events.size() ? events[i + 1].t : until + 1;
    if (request_count_ == 0 && start < next) {
      out.push_back({start, event.x, event.y, event.polarity});
      occupy(start, 1);
    } else {
      accept(event);
    }
  }
  serve_until(until + 1, out);
}

}  // namespace esim

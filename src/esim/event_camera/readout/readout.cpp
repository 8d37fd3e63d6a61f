#include "esim/event_camera/readout/readout.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace esim::inline event_camera {

Readout::Readout(const ReadoutOptions& options, int height)
    : per_event_(options.rate_mev_per_s > 0 ? std::llround(std::ldexp(1e3 / options.rate_mev_per_s, kFineBits)) : 0),
      per_row_(std::llround(std::ldexp(options.row_time_us * 1e3, kFineBits))),
      capacity_(options.queue_events > 0 ? static_cast<std::size_t>(options.queue_events)
                                         : std::numeric_limits<std::size_t>::max()),
      rows_(static_cast<std::size_t>(height)),
      queue_(std::bit_ceil(rows_.size())) {}

EventSpan Readout::serve() {
  Row& row = rows_[queue_[first_in_queue_]];
  occupy(next_service(), row.count);
  served_.assign(1, row.first);
  for (std::uint32_t i = 1, slot = row.others; i < row.count; ++i) {
    Slot& other = slots_[slot];
    served_.push_back(other.request);
    slot = std::exchange(other.next, free_slot_);
    free_slot_ = static_cast<std::uint32_t>(&other - slots_.data());
  }
  if (row.count > 1) std::ranges::sort(served_, {}, &Event::x);
  waiting_ -= row.count;
  row.count = 0;
  first_in_queue_ = (first_in_queue_ + 1) & (queue_.size() - 1);
  --queue_length_;
  return served_;
}

std::size_t Readout::serve_singly(EventSpan requests, TimeNs end, TimeNs delay, std::vector<Event>& served) {
  if (waiting_ > 0 || capacity_ < requests.size()) return 0;
  const FineTime busy = std::max(per_row_ + per_event_, kNs);
  FineTime free_at = free_at_;
  const Event* const last = requests.data() + requests.size();
  const Event* request = requests.data();
  for (; request != last; ++request) {
    const TimeNs free_from = (free_at + kNs - 1) >> kFineBits, t = std::max(free_from, request->t);
    if (t >= end || t - request->t > delay) break;
    const Event* later = request + 1;
    while (later != last && later->t <= t && later->y != request->y) ++later;
    if (later != last && later->t <= t) break;
    free_at = (t > free_from ? t << kFineBits : free_at) + busy;
    served.push_back({t, request->x, request->y, request->polarity});
  }
  free_at_ = free_at;
  return static_cast<std::size_t>(request - requests.data());
}

bool Readout::take(const Event& request) {
  if (waiting_ == capacity_) {
    ++dropped_;
    return false;
  }
  ++waiting_;
  Row& row = rows_[request.y];
  if (row.count++ == 0) [[likely]] {
    queue_[(first_in_queue_ + queue_length_++) & (queue_.size() - 1)] = request.y;
    row.first = request;
    return true;
  }
  if (free_slot_ == slots_.size()) slots_.push_back({{}, free_slot_ + 1});
  const std::uint32_t slot = free_slot_;
  free_slot_ = slots_[slot].next;
  slots_[slot] = {request, row.others};
  row.others = slot;
  return true;
}

}  // namespace esim::inline event_camera

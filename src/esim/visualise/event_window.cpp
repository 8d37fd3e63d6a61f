#include "esim/visualise/event_window.h"

#include <algorithm>

namespace esim::inline visualise {

void EventWindow::add(EventSpan events) {
  for (const Event& event : events) {
    const std::uint64_t number = seen_++;
    if (number % stride_ != 0) continue;
    if (events_.size() - head_ >= max_) make_room();
    if (number % stride_ != 0) continue;
    if (head_ > max_) {
      events_.erase(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(head_));
      if (thin_) numbers_.erase(numbers_.begin(), numbers_.begin() + static_cast<std::ptrdiff_t>(head_));
      head_ = 0;
    }
    events_.push_back(event);
    if (thin_) numbers_.push_back(number);
  }
}

void EventWindow::make_room() {
  if (!thin_) {
    ++head_;
    return;
  }
  stride_ *= 2;
  std::size_t kept = 0;
  for (std::size_t i = head_; i < events_.size(); ++i) {
    if (numbers_[i] % stride_ != 0) continue;
    events_[kept] = events_[i];
    numbers_[kept++] = numbers_[i];
  }
  events_.resize(kept);
  numbers_.resize(kept);
  head_ = 0;
}

void EventWindow::forget_until(TimeNs t) {
  const auto first = events_.begin() + static_cast<std::ptrdiff_t>(head_);
  const auto later = std::partition_point(first, events_.end(), [t](const Event& event) { return event.t <= t; });
  head_ = static_cast<std::size_t>(later - events_.begin());
}

}  // namespace esim::inline visualise

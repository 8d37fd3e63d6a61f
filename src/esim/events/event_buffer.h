#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "esim/core/large_vector.h"
#include "esim/events/event.h"

namespace esim::inline events {

/// Memory for events that is not initialised: a vector would fill it with zeros first.
class EventBuffer {
 public:
  EventBuffer() = default;
  ~EventBuffer() { LargeAllocator<Event>().deallocate(events_, capacity_); }
  EventBuffer(EventBuffer&& other) noexcept { swap(other); }
  EventBuffer& operator=(EventBuffer&& other) noexcept {
    swap(other);
    return *this;
  }

  /// Adds `count` events at the end, each of which must be written before it is read.
  Event* extend(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<Event>);
    if (size_ + count > capacity_) {
      EventBuffer larger;
      larger.capacity_ = 2 * (size_ + count);
      larger.events_ = LargeAllocator<Event>().allocate(larger.capacity_);
      larger.size_ = size_;
      std::copy_n(events_, size_, larger.events_);
      swap(larger);
    }
    size_ += count;
    return events_ + size_ - count;
  }

  /// Removes the first events.
  void drop(std::size_t count) {
    if (count < size_) std::copy(events_ + count, events_ + size_, events_);
    size_ -= count;
  }

  /// Removes the events from index `first` on for which predicate(event) is true.
  template <typename Predicate>
  void remove_if(std::size_t first, const Predicate& predicate) {
    size_ = static_cast<std::size_t>(std::remove_if(events_ + first, events_ + size_, predicate) - events_);
  }

  EventSpan events() const { return {events_, size_}; }
  std::size_t size() const { return size_; }

 private:
  void swap(EventBuffer& other) noexcept {
    std::swap(events_, other.events_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  Event* events_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace esim::inline events

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

  /// Resizes to `count` events, each of which must be written before it is read.
  Event* make_room(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<Event>);
    if (count > capacity_) {
      EventBuffer larger;
      larger.events_ = LargeAllocator<Event>().allocate(2 * count);
      larger.capacity_ = 2 * count;
      swap(larger);
    }
    size_ = count;
    return events_;
  }

  /// Removes the events from index `first` on for which predicate(event) is true.
  template <typename Predicate>
  void remove_if(std::size_t first, const Predicate& predicate) {
    size_ = static_cast<std::size_t>(std::remove_if(events_ + first, events_ + size_, predicate) - events_);
  }

  EventSpan events() const { return {events_, size_}; }
  std::size_t size() const { return size_; }
  std::size_t capacity() const { return capacity_; }
  void swap(EventBuffer& other) noexcept {
    std::swap(events_, other.events_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

 private:
  Event* events_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace esim::inline events

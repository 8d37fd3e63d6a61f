#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/formats/hdf5/library.h"

// Private to formats/hdf5.
namespace esim::inline formats::hdf5 {

/// The millisecond index of files in the layouts of DSEC and M3ED: entry ms is the number of events before that time,
/// which is the index of the first event at or after it. Times count from the start of the index.
///
/// Readers look up the first millisecond at or after the end of a window, so the index has one entry more than the
/// number of milliseconds that begin in the recording.
class MillisecondIndex {
 public:
  /// The dataset to append to; must be set before anything is written.
  void open(Series series) { series_ = std::move(series); }

  /// Counts events, which must be in order of time and not before the origin, the time 0 of the index.
  void add(EventSpan events, TimeNs origin) {
    const auto since_origin = [origin](const Event& event) { return static_cast<std::uint64_t>(event.t - origin); };
    while (!events.empty() && since_origin(events.back()) >= next_) {
      const auto first = std::ranges::lower_bound(events, next_, {}, since_origin);
      events_ += static_cast<std::uint64_t>(first - events.begin());
      events = {first, events.end()};
      complete_until(since_origin(events.front()));
    }
    events_ += events.size();
  }

  /// Adds the entries for windows up to `end`, ns, and at least those up to just after the last event.
  void finish(std::uint64_t end) {
    const std::uint64_t last = events_ > 0 ? next_ : 0;  // the first millisecond after the last event
    complete_until(std::max(last, (end + kMs - 1) / kMs * kMs));
  }

  /// Appends the completed entries to the dataset.
  void write() {
    series_.append(std::span<const std::uint64_t>(waiting_));
    waiting_.clear();
  }

  void close() { series_ = Series(); }

 private:
  static constexpr std::uint64_t kMs = kNsPerMs;
  static constexpr std::size_t kBuffer = 1 << 16;

  /// Milliseconds up to and including t begin before the next event.
  void complete_until(std::uint64_t t) {
    for (; next_ <= t; next_ += kMs) {
      waiting_.push_back(events_);
      if (waiting_.size() == kBuffer) write();
    }
  }

  Series series_;
  std::vector<std::uint64_t> waiting_;  // entries not written yet
  std::uint64_t next_ = 0;              // ns; the first millisecond without an entry
  std::uint64_t events_ = 0;
};

}  // namespace esim::inline formats::hdf5

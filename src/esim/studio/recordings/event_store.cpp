#include "esim/studio/recordings/event_store.h"

#include <algorithm>
#include <mutex>
#include <optional>

namespace esim::studio {
namespace {

constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;
constexpr TimeNs kCoarseBin = 4 * kNsPerMs;

bool is_coarse(TimeNs from, TimeNs to, std::size_t bins) {
  return (to - from) / static_cast<TimeNs>(bins) >= kCoarseBin;
}

class MemoryStore final : public EventStore {
 public:
  explicit MemoryStore(std::vector<Event> events) : events_(std::move(events)) {}

  std::uint64_t size() const override { return events_.size(); }

  Range find(TimeNs t0, TimeNs t1) const override {
    const auto before = [](const Event& event, TimeNs t) { return event.t < t; };
    const auto first = std::lower_bound(events_.begin(), events_.end(), t0, before);
    const auto end = std::lower_bound(first, events_.end(), std::max(t0, t1), before);
    return {static_cast<std::uint64_t>(first - events_.begin()), static_cast<std::uint64_t>(end - events_.begin())};
  }

  std::vector<Event> read(std::uint64_t first, std::uint64_t count) const override {
    first = std::min<std::uint64_t>(first, events_.size());
    const auto begin = events_.begin() + static_cast<std::ptrdiff_t>(first);
    return {begin, begin + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(count, events_.size() - first))};
  }

 private:
  std::vector<Event> events_;
};

class FileStore final : public EventStore {
 public:
  explicit FileStore(EventsHdf5Reader reader) : reader_(std::move(reader)), span_(reader_.time_span()) {}

  std::uint64_t size() const override { return reader_.size(); }

  Range find(TimeNs t0, TimeNs t1) const override {
    const std::lock_guard lock(mutex_);
    return reader_.find(t0, t1);
  }

  std::vector<Event> read(std::uint64_t first, std::uint64_t count) const override {
    const std::lock_guard lock(mutex_);
    return reader_.read(first, count);
  }

 protected:
  TimeNs origin() const override { return reader_.t_offset(); }

  void count(EventRate& rate) const override {
    if (!is_coarse(rate.edges.front(), rate.edges.back(), rate.on.size())) return EventStore::count(rate);
    const std::lock_guard lock(mutex_);
    if (until_ms_.empty()) make_index();
    Counts before = until(rate.edges.front());
    for (std::size_t i = 0; i < rate.on.size(); ++i) {
      const Counts after = until(rate.edges[i + 1]);
      rate.on[i] = after.on - before.on;
      rate.off[i] = (after.all - after.on) - (before.all - before.on);
      before = after;
    }
  }

 private:
  struct Counts {
    std::uint64_t all = 0, on = 0;
  };

  /// The counts before a time: from the index up to its millisecond, then by counting events.
  Counts until(TimeNs t) const {
    if (!span_ || t <= span_->start) return {};
    if (t > span_->end) return until_ms_.back();
    const TimeNs ms = std::max<TimeNs>(0, (t - reader_.t_offset()) / kNsPerMs);
    const std::size_t last = until_ms_.size() - std::min<std::size_t>(2, until_ms_.size());
    Counts counts = until_ms_[std::min(static_cast<std::size_t>(ms), last)];
    if (static_cast<std::size_t>(ms) <= last && reader_.t_offset() + ms * kNsPerMs == t) return counts;
    const std::size_t next = std::min(static_cast<std::size_t>(ms) + 1, until_ms_.size() - 1);
    const std::uint64_t end = std::min(reader_.find(t, t).first, until_ms_[next].all);
    while (counts.all < end) {
      for (const std::int8_t p : reader_.read_polarities(counts.all, std::min(kBlock, end - counts.all))) {
        counts.on += p > 0 ? 1 : 0;
        ++counts.all;
      }
    }
    return counts;
  }

  /// The counts before each ms and, as the last entry, of all events. Reads all polarities once, and all times if the
  /// file has no index.
  void make_index() const {
    std::vector<std::uint64_t> first = reader_.ms_to_idx();
    if (first.empty()) first = index_by_reading();
    first.push_back(reader_.size());
    std::vector<Counts> counts(first.size());
    std::uint64_t on = 0, at = 0;
    std::size_t ms = 0;
    while (ms < first.size() && first[ms] == 0) ++ms;
    while (at < reader_.size()) {
      const std::vector<std::int8_t> block = reader_.read_polarities(at, kBlock);
      for (const std::int8_t p : block) {
        on += p > 0 ? 1 : 0;
        ++at;
        for (; ms < first.size() && first[ms] == at; ++ms) counts[ms] = {at, on};
      }
    }
    until_ms_ = std::move(counts);
  }

  std::vector<std::uint64_t> index_by_reading() const {
    constexpr std::size_t kMaxMs = std::size_t{1} << 25;  // nine hours; limits memory if a time is damaged
    std::vector<std::uint64_t> first;
    for (std::uint64_t at = 0; at < reader_.size(); at += kBlock) {
      const std::vector<Event> block = reader_.read(at, kBlock);
      for (std::size_t i = 0; i < block.size(); ++i) {
        const TimeNs ms = (block[i].t - reader_.t_offset()) / kNsPerMs;
        while (static_cast<TimeNs>(first.size()) <= ms && first.size() < kMaxMs) first.push_back(at + i);
      }
    }
    return first;
  }

  EventsHdf5Reader reader_;
  std::optional<TimeSpan> span_;  // of the events
  mutable std::mutex mutex_;
  mutable std::vector<Counts> until_ms_;  // made on first use
};

}  // namespace

std::vector<TimeNs> bin_edges(TimeNs from, TimeNs to, std::size_t max, TimeNs unit, TimeNs origin) {
  const auto up = [](TimeNs value, TimeNs step) { return value / step * step + (value % step > 0 ? step : 0); };
  TimeNs width = std::max(unit, up((to - from + static_cast<TimeNs>(max) - 1) / static_cast<TimeNs>(max), unit));
  std::vector<TimeNs> edges;
  do {  // repeat if the partial bins at both ends are one too many
    edges.assign(1, from);
    for (TimeNs edge = origin + up(from + width / 2 - origin, width); edge + width / 2 <= to; edge += width)
      edges.push_back(edge);
    edges.push_back(to);
    width += unit;
  } while (edges.size() - 1 > max);
  return edges;
}

EventRate EventStore::rate(TimeNs from, TimeNs to, std::size_t max) const {
  const TimeNs unit = is_coarse(from, to, max) ? kNsPerMs : kNsPerUs;
  EventRate rate;
  rate.edges = bin_edges(from, to, max, unit, origin());
  rate.on.resize(rate.edges.size() - 1);
  rate.off.resize(rate.on.size());
  count(rate);
  return rate;
}

void EventStore::count(EventRate& rate) const {
  const Range range = find(rate.edges.front(), rate.edges.back());
  std::size_t bin = 0;
  for (std::uint64_t at = range.first; at < range.end; at += kBlock) {
    for (const Event& event : read(at, std::min(kBlock, range.end - at))) {
      while (bin + 1 < rate.on.size() && event.t >= rate.edges[bin + 1]) ++bin;
      ++(event.polarity > 0 ? rate.on : rate.off)[bin];
    }
  }
}

std::vector<Event> EventStore::thinned(Range range, std::uint64_t max) const {
  const std::uint64_t all = range.end - range.first;
  if (all <= max) return read(range.first, all);
  std::vector<Event> kept;
  kept.reserve(max);
  // Reads a small range completely; takes runs of consecutive events from a larger one.
  constexpr std::uint64_t kReadAll = std::uint64_t{1} << 22, kRun = 64;
  const std::uint64_t run = all <= kReadAll ? 1 : kRun;
  const std::uint64_t runs = std::max<std::uint64_t>(1, max / run);
  const std::vector<Event> events = run == 1 ? read(range.first, all) : std::vector<Event>();
  for (std::uint64_t i = 0; i < runs; ++i) {
    const auto at =
        static_cast<std::uint64_t>(static_cast<double>(all) * static_cast<double>(i) / static_cast<double>(runs));
    if (run == 1) {
      kept.push_back(events[at]);
    } else {
      const std::vector<Event> neighbours = read(range.first + at, std::min(run, all - at));
      kept.insert(kept.end(), neighbours.begin(), neighbours.end());
    }
  }
  return kept;
}

std::unique_ptr<EventStore> store_of(EventsHdf5Reader reader) { return std::make_unique<FileStore>(std::move(reader)); }

std::unique_ptr<EventStore> store_of(std::vector<Event> events) {
  return std::make_unique<MemoryStore>(std::move(events));
}

}  // namespace esim::studio

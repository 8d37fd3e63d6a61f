#include "esim/recording/record_stream.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline recording {
namespace {

class MergedSource final : public Source {
 public:
  MergedSource(RecordingInfo info, std::vector<std::unique_ptr<RecordStream>> streams, const ReadOptions& options,
               std::optional<TimeNs> start)
      : info_(std::move(info)), recover_(options.recover) {
    for (auto& stream : streams) {
      entries_.push_back({std::move(stream)});
      look_ahead(entries_.back());
      const Entry& entry = entries_.back();
      if (entry.due && !entry.damage) start = std::min(start.value_or(*entry.due), *entry.due);
    }
    t_ = info_.start = start.value_or(0);
    info_.end = std::max(info_.end, info_.start);
  }

  const RecordingInfo& info() const override { return info_; }

  double progress() const override {
    if (ended_) return 1;
    const double length = static_cast<double>(info_.end - info_.start);
    return length > 0 ? std::clamp(static_cast<double>(t_ - info_.start) / length, 0.0, 1.0) : 0.0;
  }

  const Record* next() override {
    if (taken_ != nullptr) look_ahead(*std::exchange(taken_, nullptr));
    while (Entry* const entry = earliest()) {
      try {
        if (entry->damage) std::rethrow_exception(entry->damage);
        const Record* const record = entry->stream->next(turn_of(*entry));
        t_ = std::max(t_, *entry->due);
        if (record == nullptr) {
          look_ahead(*entry);
          continue;
        }
        taken_ = entry;
        return record;
      } catch (const UserError& error) {
        if (!recover_) {
          entries_.clear();  // the stream has ended
          throw;
        }
        recover_(error.what());
        entry->due.reset();
      }
    }
    ended_ = true;
    return nullptr;
  }

 private:
  struct Entry {
    std::unique_ptr<RecordStream> stream{};
    std::optional<TimeNs> due{};
    std::exception_ptr damage{};
  };

  /// A damaged stream is due right after its last record.
  static void look_ahead(Entry& entry) {
    const TimeNs last = entry.due.value_or(std::numeric_limits<TimeNs>::min() / 2);
    try {
      entry.due = entry.stream->due();
    } catch (const UserError&) {
      entry.due = last;
      entry.damage = std::current_exception();
    }
  }

  Entry* earliest() {
    Entry* earliest = nullptr;
    for (Entry& entry : entries_) {
      if (entry.due && (earliest == nullptr || *entry.due < *earliest->due)) earliest = &entry;
    }
    return earliest;
  }

  /// The last time until which no other stream is due before this one.
  TimeNs turn_of(const Entry& entry) const {
    TimeNs until = std::numeric_limits<TimeNs>::max();
    for (const Entry& other : entries_) {
      if (&other != &entry && other.due) until = std::min(until, &other < &entry ? *other.due - 1 : *other.due);
    }
    return until;
  }

  RecordingInfo info_;
  std::vector<Entry> entries_;
  std::function<void(const std::string&)> recover_;
  Entry* taken_ = nullptr;  // its last record is in use
  TimeNs t_ = 0;
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<Source> merge_streams(RecordingInfo info, std::vector<std::unique_ptr<RecordStream>> streams,
                                      const ReadOptions& options, std::optional<TimeNs> start) {
  return std::make_unique<MergedSource>(std::move(info), std::move(streams), options, start);
}

}  // namespace esim::inline recording

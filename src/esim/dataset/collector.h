#pragma once

#include <vector>

#include "esim/dataset/sequence.h"
#include "esim/recording/record.h"

namespace esim::inline dataset {

/// Collects the events of the sensors of a recording's first camera, each in a sequence of its own.
class Collector final : public Sink {
 public:
  /// One sequence for each sensor of the only camera, in their order.
  explicit Collector(std::vector<Sequence>& sequences) : sequences_(sequences) {}

  void begin(const RecordingInfo& info) override {
    first_ = info.cameras.size() - sequences_.size();  // a camera with several sensors has no events of its own
    for (Sequence& sequence : sequences_) {
      sequence.width = info.cameras.front().model.width;
      sequence.height = info.cameras.front().model.height;
      sequence.span = {info.start, info.end};
    }
  }

  void write(const Record& record) override {
    if (const auto* const events = std::get_if<EventsRecord>(&record)) {
      std::vector<Event>& all = sequences_.at(static_cast<std::size_t>(events->camera) - first_).events;
      all.insert(all.end(), events->events.begin(), events->events.end());
    }
  }

  void end(bool) override {}

 private:
  std::vector<Sequence>& sequences_;
  std::size_t first_ = 0;  // of their cameras in the recording
};

}  // namespace esim::inline dataset

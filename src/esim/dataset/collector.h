#pragma once

#include <stdexcept>

#include "esim/dataset/sequence.h"
#include "esim/recording/record.h"

namespace esim::inline dataset {

/// Collects the events of a recording's first camera in a sequence.
class Collector final : public Sink {
 public:
  explicit Collector(Sequence& sequence) : sequence_(sequence) {}

  void begin(const RecordingInfo& info) override {
    sequence_.width = info.cameras.front().model.width;
    sequence_.height = info.cameras.front().model.height;
    sequence_.span = {info.start, info.end};
  }

  void write(const Record& record) override {
    if (const auto* const events = std::get_if<EventsRecord>(&record)) {
      if (events->camera == 0)
        sequence_.events.insert(sequence_.events.end(), events->events.begin(), events->events.end());
    }
  }

  void end(bool) override {}

 private:
  Sequence& sequence_;
};

}  // namespace esim::inline dataset

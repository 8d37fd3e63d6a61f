#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "esim/events/event.h"
#include "esim/record/format.h"

namespace esim {

/// Reads the events of one camera: all that a format which holds nothing else needs to be a Source.
class EventsReader {
 public:
  virtual ~EventsReader() = default;

  /// 0 x 0 where the file does not say.
  virtual SensorSize sensor() const { return {}; }

  /// Start and end of the recording, which may be before the first event and after the last one; nothing where the
  /// file does not tell. The end may also be merely that of the events.
  virtual std::optional<TimeNs> start() const { return std::nullopt; }
  virtual std::optional<TimeNs> end() const { return std::nullopt; }

  /// Appends the next events, some 10^4 to 10^5; false if there are none left. Where the file is damaged, appends what
  /// comes before and throws UserError.
  virtual bool read(std::vector<Event>& events) = 0;

  /// The fraction of the file that has been read.
  virtual double progress() const = 0;
};

std::unique_ptr<Source> make_events_source(std::unique_ptr<EventsReader> reader, const ReadOptions& options);

}  // namespace esim

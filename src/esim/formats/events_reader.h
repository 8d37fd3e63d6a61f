#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/events/event.h"
#include "esim/events/event_label.h"
#include "esim/recording/format.h"

namespace esim::inline formats {

/// Reads the events of one camera, and its triggers. A format that holds only these needs nothing else to be a Source.
class EventsReader {
 public:
  virtual ~EventsReader() = default;

  /// 0 x 0 if the file does not state it.
  virtual SensorSize sensor() const { return {}; }

  /// Start and end of the recording, which may be before the first event and after the last one; nothing if the file
  /// does not state them. The end may be that of the events only.
  virtual std::optional<TimeNs> start() const { return std::nullopt; }
  virtual std::optional<TimeNs> end() const { return std::nullopt; }

  /// Appends the next events, some 10^4 to 10^5; returns false at the end. If the file is damaged, appends the events
  /// before the damage and throws UserError.
  virtual bool read(std::vector<Event>& events) = 0;

  /// Whether the file has labels.
  virtual bool has_labels() const { return false; }
  /// Appends the labels of all events that have been read since the last call.
  virtual void read_labels(std::vector<EventLabel>&) {}

  /// Appends the triggers that have been read since the last call, in order of time.
  virtual void read_triggers(std::vector<TriggerRecord>&) {}

  /// Unsupported parts of the file, as Source::not_read().
  virtual std::vector<std::string> not_read() const { return {}; }

  /// The fraction of the file that has been read.
  virtual double progress() const = 0;
};

std::unique_ptr<Source> make_events_source(std::unique_ptr<EventsReader> reader, const ReadOptions& options);

}  // namespace esim::inline formats

#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <string>

#include "esim/record/format.h"

namespace esim {

/// Writes the events of one camera: all that a format which holds nothing else needs to be a Sink. Failures are
/// OutputErrors.
class EventsWriter {
 public:
  virtual ~EventsWriter() = default;

  /// Creates the file. The sensor is 0 x 0 where its size is not known.
  virtual void begin(const std::filesystem::path& path, SensorSize sensor) = 0;

  /// All within the limits, in order of time.
  virtual void write(EventSpan events) = 0;

  /// Makes everything durable.
  virtual void end() = 0;
};

/// What a format has no room beyond.
struct EventLimits {
  int max_width = 65536, max_height = 65536;  ///< px
  TimeNs min_time = std::numeric_limits<TimeNs>::min(), max_time = std::numeric_limits<TimeNs>::max();
};

/// A Sink of the events of camera 0. What is beyond the limits of the format of that name, or outside the camera, is a
/// UserError that says what, and what else would hold it.
std::unique_ptr<Sink> make_events_sink(std::unique_ptr<EventsWriter> writer, std::filesystem::path path,
                                       std::string format, EventLimits limits);

}  // namespace esim

#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Writes the events of one camera. A format that holds only events needs nothing else to be a Sink. Failures are
/// OutputErrors.
class EventsWriter {
 public:
  virtual ~EventsWriter() = default;

  /// Creates the file. The sensor is 0 x 0 if its size is unknown.
  virtual void begin(const std::filesystem::path& path, SensorSize sensor) = 0;

  /// Appends events that are within the limits and in order of time.
  virtual void write(EventSpan events) = 0;

  /// Before begin(), if labels follow their events. Formats that can hold them override both functions.
  virtual void expect_labels() {}
  /// Appends the labels of the events that were written last.
  virtual void write_labels(LabelSpan) {}

  /// Makes everything durable.
  virtual void end() = 0;
};

/// For formats that count pixels from another corner than the upper left one: throws RemediableError if the size of the
/// sensor is unknown (0 x 0).
void require_size(const std::filesystem::path& path, SensorSize sensor);

/// A Sink for the events of camera 0. Events beyond the limits of the Format of that name, or outside the sensor, are a
/// UserError that names the problem and a format that would work.
std::unique_ptr<Sink> make_events_sink(std::unique_ptr<EventsWriter> writer, std::filesystem::path path,
                                       std::string_view format);

}  // namespace esim::inline formats

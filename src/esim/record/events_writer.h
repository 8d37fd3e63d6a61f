#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

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

/// A Sink of the events of camera 0. What is beyond the limits of the Format of that name, or outside the camera, is a
/// UserError that says what, and what else would hold it.
std::unique_ptr<Sink> make_events_sink(std::unique_ptr<EventsWriter> writer, std::filesystem::path path,
                                       std::string_view format);

}  // namespace esim

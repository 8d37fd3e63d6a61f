#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "esim/recording/record.h"

/// Sinks that modify records and pass them on to another sink.
namespace esim::inline recording {

/// Passes on the records of one camera, as camera 0 and the only one, and those that belong to no camera.
class OneCamera final : public Sink {
 public:
  OneCamera(std::unique_ptr<Sink> inner, int camera) : OneCamera(std::move(inner), camera, camera) {}

  /// The same with the events of camera `sensor`, an event sensor that shares the lens of `camera`.
  OneCamera(std::unique_ptr<Sink> inner, int camera, int sensor)
      : inner_(std::move(inner)), camera_(camera), sensor_(sensor) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override { inner_->end(complete); }

 private:
  std::unique_ptr<Sink> inner_;
  int camera_, sensor_;
};

/// Passes all records on, with times relative to the start of the recording.
class FromZero final : public Sink {
 public:
  explicit FromZero(std::unique_ptr<Sink> inner) : inner_(std::move(inner)) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override { inner_->end(complete); }

 private:
  std::unique_ptr<Sink> inner_;
  TimeNs start_ = 0;
  std::vector<Event> events_;
  std::vector<EventLabel> labels_;
};

}  // namespace esim::inline recording

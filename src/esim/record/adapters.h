#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "esim/record/record.h"

/// Sinks that change what they pass on to another.
namespace esim {

/// Passes on one camera, as camera 0 and the only one, and what belongs to none.
class OneCamera final : public Sink {
 public:
  OneCamera(std::unique_ptr<Sink> inner, int camera) : inner_(std::move(inner)), camera_(camera) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override { inner_->end(complete); }

 private:
  std::unique_ptr<Sink> inner_;
  int camera_;
};

/// Passes everything on at times that count from the start of the recording.
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
};

}  // namespace esim

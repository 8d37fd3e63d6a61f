#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "esim/recording/record.h"

namespace esim::inline recording {

/// Passes everything on to several sinks, in their order. If one of them fails to write a record, the others are ended
/// as incomplete, so that they keep what they have received; then the failure is rethrown, and nothing more is passed
/// on.
class FanOut final : public Sink {
 public:
  FanOut() = default;
  explicit FanOut(std::vector<std::unique_ptr<Sink>> sinks) : sinks_(std::move(sinks)) {}

  void add(std::unique_ptr<Sink> sink) { sinks_.push_back(std::move(sink)); }

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;

  /// Ends every sink, even if one of them fails; then rethrows the first failure.
  void end(bool complete) override;

 private:
  void end_rest() noexcept;

  std::vector<std::unique_ptr<Sink>> sinks_;
};

}  // namespace esim::inline recording

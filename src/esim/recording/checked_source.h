#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "esim/recording/format.h"

namespace esim::inline recording {

/// Checks the events of a Source, so that its users need not: every event is on the sensor, as far as its size is
/// known, and not earlier than the event before it; every time is within 146 years of 0. Anything else is a UserError
/// with file, index and values. With `recover`, the recording ends there, and at damage, instead.
class CheckedSource final : public Source {
 public:
  CheckedSource(std::unique_ptr<Source> inner, std::filesystem::path path, ReadOptions options);

  const RecordingInfo& info() const override { return inner_->info(); }
  const Record* next() override;
  std::vector<std::string> not_read() const override { return inner_->not_read(); }
  double progress() const override { return inner_->progress(); }

 private:
  struct Stream {
    std::uint64_t count = 0;
    std::optional<TimeNs> last{};
  };

  const Record* checked(const EventsRecord& record);
  [[noreturn]] void fail(const Event& event, int camera) const;

  std::unique_ptr<Source> inner_;
  std::filesystem::path path_;
  ReadOptions options_;
  std::vector<Stream> streams_;       // events of each camera so far
  std::optional<Record> part_;        // the valid events at the start of a record,
  std::optional<EventsRecord> rest_;  // and the rest, which starts with an invalid one
  bool ended_ = false;
};

}  // namespace esim::inline recording

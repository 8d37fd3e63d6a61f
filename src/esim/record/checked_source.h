#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "esim/record/format.h"

namespace esim {

/// Holds a Source to what it promises, so that nobody behind it needs to: every event is on the sensor, as far as its
/// size is known, and not before the one above it; every time is one of a recording, within 146 years of 0. Anything
/// else is a UserError with file, index and values. With `recover`, the recording ends there, and at damage, instead.
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
  std::optional<Record> part_;        // what is sound of a record,
  std::optional<EventsRecord> rest_;  // and the rest, which begins with an event that is not
  bool ended_ = false;
};

}  // namespace esim

#pragma once

#include "esim/record/events_reader.h"

namespace esim {

/// Reads events that a file counts, block by block.
class EventBlocksReader : public EventsReader {
 public:
  /// Of a block that cannot be read whole, half, and so on.
  bool read(std::vector<Event>& events) final;

  double progress() const final;

 protected:
  /// Of the whole file.
  virtual std::uint64_t event_count() const = 0;

  /// Appends [first, first + count); throws UserError where one of them is damaged.
  virtual void read_block(std::uint64_t first, std::uint64_t count, std::vector<Event>& events) = 0;

 private:
  std::uint64_t done_ = 0;  // events
};

}  // namespace esim

#pragma once

#include "esim/formats/events_reader.h"

namespace esim::inline formats {

/// Reads the events of a file with a known number of events, block by block.
class EventBlocksReader : public EventsReader {
 public:
  /// If a block cannot be read, tries half of it, and so on, down to the damage.
  bool read(std::vector<Event>& events) final;

  double progress() const final;

 protected:
  /// Number of events in the file.
  virtual std::uint64_t event_count() const = 0;

  /// Appends [first, first + count); throws UserError if one of them is damaged.
  virtual void read_block(std::uint64_t first, std::uint64_t count, std::vector<Event>& events) = 0;

 private:
  std::uint64_t done_ = 0;  // events
};

}  // namespace esim::inline formats

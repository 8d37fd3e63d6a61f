#include "esim/formats/hdf5/event_blocks.h"

#include <algorithm>

#include "esim/core/error.h"

namespace esim::inline formats {

bool EventBlocksReader::read(std::vector<Event>& events) {
  constexpr std::uint64_t kBlock = 1 << 16;
  const std::size_t before = events.size();
  for (std::uint64_t count = std::min(kBlock, event_count() - done_); count > 0; count = (count + 1) / 2) {
    try {
      read_block(done_, count, events);
      done_ += count;
      return true;
    } catch (const UserError&) {
      events.resize(before);
      if (count == 1) throw;
    }
  }
  return false;
}

double EventBlocksReader::progress() const {
  return event_count() > 0 ? static_cast<double>(done_) / static_cast<double>(event_count()) : 1.0;
}

}  // namespace esim::inline formats

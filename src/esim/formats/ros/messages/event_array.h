#pragma once

#include <vector>

#include "esim/events/event.h"
#include "esim/formats/ros/messages/messages.h"

namespace esim::inline formats::ros {

/// The fields of dvs_msgs/EventArray without its events.
struct EventArrayHead {
  Header header{};
  std::uint32_t height = 0, width = 0;  // px

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.height, self.width);
  }
};

/// Appends the events, which follow the fields above.
void write_events(MessageWriter& writer, EventSpan events);

/// Replaces `events` by those after the header.
void read_events(MessageReader& reader, std::vector<Event>& events);

}  // namespace esim::inline formats::ros

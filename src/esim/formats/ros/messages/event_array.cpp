#include "esim/formats/ros/messages/event_array.h"

namespace esim::inline formats::ros {
namespace {

// An event is x, y: uint16; seconds, nanoseconds: 32 bits each; polarity: uint8. ROS 1 packs them. CDR aligns the first
// event to a multiple of 4 and each number to its size: events have a period of 16 bytes, and in all but the first, x
// and y start 2 bytes earlier.
template <Encoding encoding>
struct Layout {
  static constexpr std::size_t kSize = 13;
  static constexpr std::size_t kPeriod = encoding == Encoding::cdr ? 16 : kSize;

  static std::uint64_t bytes(std::uint64_t count) { return count == 0 ? 0 : (count - 1) * kPeriod + kSize; }
  static std::size_t x(std::size_t i) { return i * kPeriod - (encoding == Encoding::cdr && i > 0 ? 2 : 0); }
  static std::size_t y(std::size_t i) { return x(i) + 2; }
  static std::size_t seconds(std::size_t i) { return i * kPeriod + 4; }
  static std::size_t nanoseconds(std::size_t i) { return i * kPeriod + 8; }
  static std::size_t polarity(std::size_t i) { return i * kPeriod + 12; }
};

template <Encoding encoding>
void write(MessageWriter& writer, EventSpan events) {
  using At = Layout<encoding>;
  char* const out = writer.append(At::bytes(events.size()));
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    store(out + At::x(i), event.x);
    store(out + At::y(i), event.y);
    store(out + At::seconds(i), static_cast<std::uint32_t>(event.t / kNsPerSecond));
    store(out + At::nanoseconds(i), static_cast<std::uint32_t>(event.t % kNsPerSecond));
    out[At::polarity(i)] = event.polarity > 0 ? 1 : 0;
  }
}

template <Encoding encoding>
void read(MessageReader& reader, std::size_t count, std::vector<Event>& events) {
  using At = Layout<encoding>;
  using Seconds = std::conditional_t<encoding == Encoding::cdr, std::int32_t, std::uint32_t>;
  const std::byte* const from = reader.take(At::bytes(count)).data();
  events.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    events[i] = {TimeNs{load_unaligned<Seconds>(from + At::seconds(i))} * kNsPerSecond +
                     load_unaligned<std::uint32_t>(from + At::nanoseconds(i)),
                 load_unaligned<std::uint16_t>(from + At::x(i)), load_unaligned<std::uint16_t>(from + At::y(i)),
                 static_cast<std::int8_t>(from[At::polarity(i)] != std::byte{0} ? 1 : -1)};
  }
}

}  // namespace

void write_events(MessageWriter& writer, EventSpan events) {
  writer.count(events.size());
  writer.encoding() == Encoding::cdr ? write<Encoding::cdr>(writer, events) : write<Encoding::ros1>(writer, events);
}

void read_events(MessageReader& reader, std::vector<Event>& events) {
  const std::size_t count = reader.count();
  reader.encoding() == Encoding::cdr ? read<Encoding::cdr>(reader, count, events)
                                     : read<Encoding::ros1>(reader, count, events);
}

}  // namespace esim::inline formats::ros

#include "esim/formats/ros/messages/event_packet.h"

#include <algorithm>
#include <bit>

namespace esim::inline formats::ros {
namespace {

constexpr std::int64_t kMaxTimeBase = std::int64_t{1} << 62;  // ns

Event event_at(TimeNs t, std::uint64_t x, std::uint64_t y, bool on) {
  return {t, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::int8_t>(on ? 1 : -1)};
}

/// Calls take(word) for each word.
template <typename Word, typename Take>
void for_each_word(Bytes bytes, const Take& take) {
  if (bytes.size() % sizeof(Word) != 0) throw Malformed("its events end within a word");
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(Word)) take(load_unaligned<Word>(bytes.data() + i));
}

/// The fields of a word of mono and trigger: bits 0 to 31 are ns after the time base.
struct MonoWord {
  std::uint64_t word;

  TimeNs after() const { return static_cast<TimeNs>(word & 0xFFFFFFFFU); }
  std::uint64_t x() const { return word >> 32 & 0xFFFFU; }
  std::uint64_t y() const { return word >> 48 & 0x7FFFU; }
  bool on() const { return word >> 63 != 0; }
};

/// Events of libcaer: 32 bits of address, and 31 bits of time in us, which wrap.
void decode_libcaer(Bytes bytes, TimeNs base, std::vector<Event>& events) {
  constexpr TimeNs kTurn = (TimeNs{1} << 31) * kNsPerUs;
  TimeNs last = 0;
  for_each_word<std::uint64_t>(bytes, [&](std::uint64_t word) {
    const TimeNs after = static_cast<TimeNs>(word >> 32 & 0x7FFFFFFFU) * kNsPerUs;
    if (after < last) base += kTurn;
    if (base > kMaxTimeBase) throw Malformed("its times are out of range");
    last = after;
    events.push_back(event_at(base + after, word >> 17 & 0x7FFFU, word >> 2 & 0x7FFFU, (word >> 1 & 1U) != 0));
  });
}

/// Words of 16 bits, as in EVT 3.0, with the roles of rows and columns exchanged; times are us after the time base.
void decode_compressed_libcaer(Bytes bytes, TimeNs base, std::vector<Event>& events) {
  enum Type : std::uint16_t { kTimeHigh, kTimeLow, kAddressX, kAddressY, kVectorBase, kVector8 };
  TimeNs high = 0, low = 0;
  std::uint32_t x = 0, base_y = 0;
  bool on = false;
  const auto put = [&](std::uint32_t y, bool is_on) {
    events.push_back(event_at(base + (high + low) * kNsPerUs, x, y, is_on));
  };
  for_each_word<std::uint16_t>(bytes, [&](std::uint16_t word) {
    const std::uint32_t value = word & 0xFFFU;
    switch (word >> 12) {
      case kTimeHigh:
        high = TimeNs{value} << prophesee::evt3::kTimeBits;
        break;
      case kTimeLow:
        low = value;
        break;
      case kAddressX:
        x = value & 0x7FFU;
        break;
      case kAddressY:
        put(value & 0x7FFU, (value & 0x800U) != 0);
        break;
      case kVectorBase:
        base_y = value & 0x7FFU, on = (value & 0x800U) != 0;
        break;
      case kVector8:
        for (std::uint32_t valid = value & 0xFFU; valid != 0; valid &= valid - 1)
          put(base_y + static_cast<std::uint32_t>(std::countr_zero(valid)), on);
        base_y += 8;
        break;
      default:
        throw Malformed("it has a word of an unknown type");
    }
  });
}

}  // namespace

void EventPacketDecoder::decode(const EventPacketMessage& packet, std::vector<Event>& events,
                                std::vector<Trigger>& triggers) {
  events.clear(), triggers.clear();
  if (packet.is_bigendian != 0) throw Malformed("its events are big-endian, which is not supported");
  const auto base = static_cast<TimeNs>(packet.time_base);
  if (base < 0 || base > kMaxTimeBase) throw Malformed("its time base is out of range");
  if (packet.encoding == "libcaer") return decode_libcaer(packet.events, base, events);
  if (packet.encoding == "libcaer_cmp") return decode_compressed_libcaer(packet.events, base, events);
  if (packet.encoding == "evt3") {
    decode_evt3(packet.events, events, triggers);
  } else if (packet.encoding == "mono") {
    for_each_word<std::uint64_t>(packet.events, [&](std::uint64_t word) {
      const MonoWord mono{word};
      events.push_back(event_at(base + mono.after(), mono.x(), mono.y(), mono.on()));
    });
  } else if (packet.encoding == "trigger") {
    for_each_word<std::uint64_t>(packet.events, [&](std::uint64_t word) {
      triggers.push_back({base + MonoWord{word}.after(), MonoWord{word}.on()});
    });
  } else {
    throw Malformed("its events are encoded as \"" + packet.encoding +
                    "\"; supported: evt3, mono, libcaer, libcaer_cmp, trigger");
  }
  if (events.empty() && triggers.empty()) return;
  if (!shift_) {
    const TimeNs first = events.empty()     ? triggers[0].t
                         : triggers.empty() ? events[0].t
                                            : std::min(events[0].t, triggers[0].t);
    shift_ = packet.header.stamp - first;
  }
  for (Event& event : events) event.t += *shift_;
  for (Trigger& trigger : triggers) trigger.t += *shift_;
}

void EventPacketDecoder::decode_evt3(Bytes bytes, std::vector<Event>& events, std::vector<Trigger>& triggers) {
  words_.clear();
  for_each_word<std::uint16_t>(bytes, [&](std::uint16_t word) { words_.push_back(word); });
  const bool in_range = evt3_.decode<false>(
      words_, [&](TimeNs t, std::uint32_t x, std::uint32_t y, bool on) { events.push_back(event_at(t, x, y, on)); },
      [&](TimeNs t, bool rising) {
        triggers.push_back({t, rising});
      });
  if (!in_range) throw Malformed("its times are out of range");
}

void EventPacketEncoder::encode(EventSpan events, EventPacketMessage& packet) {
  const TimeNs first = events.front().t;
  if (encoding_ == PacketEncoding::evt3) {
    // Programs that receive only later packets, too, can decode each of them.
    evt3_.clear();
    evt3_.begin(first / kNsPerUs);
    evt3_.write(events);
    evt3_.end();
    packet.encoding = "evt3";
    packet.header.stamp = first / kNsPerUs * kNsPerUs;
    packet.events = std::as_bytes(evt3_.words());
  } else {
    mono_.clear();
    for (const Event& event : events) {
      const std::uint64_t on = event.polarity > 0 ? 1 : 0;
      append_number(mono_, static_cast<std::uint64_t>(event.t - first) | std::uint64_t{event.x} << 32 |
                               std::uint64_t{event.y} << 48 | on << 63);
    }
    packet.encoding = "mono";
    packet.header.stamp = first;
    packet.events = as_bytes(mono_);
  }
  packet.seq = count_++;
  packet.time_base = static_cast<std::uint64_t>(packet.header.stamp);
  packet.is_bigendian = 0;
}

}  // namespace esim::inline formats::ros

#include "esim/formats/ros/messages/event_packet.h"

#include <gtest/gtest.h>

#include <random>

#include "esim/core/error.h"
#include "formats/ros_messages.h"
#include "support/errors.h"
#include "support/temporary_directory.h"
#include "support/test_data.h"

namespace esim {
namespace {

using ros::EventPacketDecoder;
using ros::EventPacketEncoder;
using ros::EventPacketMessage;
using ros::PacketEncoding;

struct Decoded {
  std::vector<Event> events;
  std::vector<EventPacketDecoder::Trigger> triggers;
};

Decoded decoded(EventPacketDecoder& decoder, const EventPacketMessage& packet) {
  Decoded result;
  decoder.decode(packet, result.events, result.triggers);
  return result;
}

template <typename Word>
std::string bytes_of(const std::vector<Word>& words) {
  std::string bytes;
  for (const Word word : words) ros::append_number(bytes, word);
  return bytes;
}

EventPacketMessage packet_of(const std::string& encoding, const std::string& bytes, TimeNs stamp, std::uint64_t base) {
  EventPacketMessage packet{.height = 480, .width = 640, .time_base = base, .encoding = encoding};
  packet.header.stamp = stamp;
  packet.events = ros::as_bytes(bytes);
  return packet;
}

std::vector<Event> random_events(std::size_t count, TimeNs start, TimeNs unit) {
  std::mt19937 random(7);
  std::vector<Event> events;
  TimeNs t = start;
  for (std::size_t i = 0; i < count; ++i) {
    t += random() % 3 == 0 ? static_cast<TimeNs>(random() % 40) * unit : 0;
    events.push_back({t, static_cast<std::uint16_t>(random() % 640), static_cast<std::uint16_t>(random() % 8),
                      static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)});
  }
  return events;
}

// The message that rosbags 0.11.9 gives for these fields.
TEST(EventPacket, IsEncodedAsInRos2) {
  const std::string events("\x00\x01\x02\x03", 4);
  EventPacketMessage packet = packet_of("evt3", events, kNsPerSecond + 2, 0);
  packet.header.frame_id = "cam", packet.seq = 7;
  const std::string expected(
      "\x00\x01\x00\x00\x01\x00\x00\x00\x02\x00\x00\x00\x04\x00\x00\x00"
      "cam\x00\xe0\x01\x00\x00\x80\x02\x00\x00\x07\x00\x00\x00\x00\x00\x00\x00"
      "\x00\x00\x00\x00\x00\x00\x00\x00\x05\x00\x00\x00"
      "evt3\x00\x00\x00\x00\x04\x00\x00\x00\x00\x01\x02\x03",
      64);
  const std::string found = test::encoded(packet, ros::Encoding::cdr);
  EXPECT_EQ(found, expected) << found.size();
}

TEST(EventPacket, Evt3IsDecodedAcrossPackets) {
  EventPacketDecoder decoder;
  // Without a time, nothing can be decoded.
  EXPECT_TRUE(decoded(decoder, packet_of("evt3", bytes_of<std::uint16_t>({0x0005, 0x2003}), 0, 0)).events.empty());
  // High bits 2, low bits 3: 8195 us. Row 9, ON at 4; a rising trigger; OFF at 7 and 9 in a vector.
  const auto first = decoded(
      decoder, packet_of("evt3", bytes_of<std::uint16_t>({0x8002, 0x6003, 0x0009, 0x2804, 0xA001, 0x3007, 0x5005}),
                         5 * kNsPerSecond, 123));
  const TimeNs t = 5 * kNsPerSecond;
  EXPECT_EQ(first.events, (std::vector<Event>{{t, 4, 9, 1}, {t, 7, 9, -1}, {t, 9, 9, -1}}));
  ASSERT_EQ(first.triggers.size(), 1U);
  EXPECT_EQ(first.triggers[0].t, t);
  EXPECT_TRUE(first.triggers[0].rising);
  // The row, the base and the high bits of the time last; later stamps do not count.
  const auto second =
      decoded(decoder, packet_of("evt3", bytes_of<std::uint16_t>({0x6004, 0x5001}), 9 * kNsPerSecond, 0));
  EXPECT_EQ(second.events, (std::vector<Event>{{t + kNsPerUs, 15, 9, -1}}));
}

TEST(EventPacket, MonoLibcaerAndTriggersAreDecoded) {
  const std::uint64_t base = 1'000'000'000'000;
  const auto time = static_cast<TimeNs>(base);
  EventPacketDecoder mono, libcaer, compressed, trigger;
  const std::uint64_t on = std::uint64_t{1} << 63;
  EXPECT_EQ(
      decoded(mono, packet_of("mono", bytes_of<std::uint64_t>({5 | 3ULL << 32 | 4ULL << 48 | on}), 77, base)).events,
      (std::vector<Event>{{77, 3, 4, 1}}));
  EXPECT_EQ(decoded(mono, packet_of("mono", bytes_of<std::uint64_t>({9 | 1ULL << 32}), 0, base)).events,
            (std::vector<Event>{{81, 1, 0, -1}}));

  // Address: valid, ON, y = 6, x = 11; the time wraps after 2^31 us.
  const std::uint64_t address = 1 | 1U << 1 | 6U << 2 | 11U << 17;
  const auto two = decoded(
      libcaer, packet_of("libcaer", bytes_of<std::uint64_t>({0x7FFFFFFFULL << 32 | address, address ^ 2}), 0, base));
  EXPECT_EQ(two.events,
            (std::vector<Event>{{time + 2147483647 * kNsPerUs, 11, 6, 1}, {time + 2147483648 * kNsPerUs, 11, 6, -1}}));

  // High bits 1, low bits 2: 4098 us. Column 11: ON at 6, OFF at 20 and 22, then at 28.
  const auto column =
      decoded(compressed,
              packet_of("libcaer_cmp",
                        bytes_of<std::uint16_t>({0x0001, 0x1002, 0x200B, 0x3806, 0x4014, 0x5005, 0x5001}), 0, base));
  const TimeNs t = time + 4098 * kNsPerUs;
  EXPECT_EQ(column.events, (std::vector<Event>{{t, 11, 6, 1}, {t, 11, 20, -1}, {t, 11, 22, -1}, {t, 11, 28, -1}}));

  const auto edges = decoded(trigger, packet_of("trigger", bytes_of<std::uint64_t>({5 | on, 8}), 100, base));
  EXPECT_TRUE(edges.events.empty());
  ASSERT_EQ(edges.triggers.size(), 2U);
  EXPECT_EQ(edges.triggers[0].t, 100);
  EXPECT_TRUE(edges.triggers[0].rising);
  EXPECT_EQ(edges.triggers[1].t, 103);
  EXPECT_FALSE(edges.triggers[1].rising);
}

TEST(EventPacket, DamageIsAnError) {
  const auto problem_of = [](const EventPacketMessage& packet) {
    EventPacketDecoder decoder;
    return test::message_of<ros::Malformed>([&] { decoded(decoder, packet); });
  };
  const std::string three(3, '\0');
  for (const char* encoding : {"evt3", "mono", "libcaer", "libcaer_cmp", "trigger"})
    EXPECT_TRUE(test::contains(problem_of(packet_of(encoding, three, 0, 0)), "within a word")) << encoding;
  EXPECT_TRUE(test::contains(problem_of(packet_of("evt21", "", 0, 0)), "\"evt21\""));
  EXPECT_TRUE(test::contains(problem_of(packet_of("mono", "", 0, ~std::uint64_t{0})), "time base"));
  EXPECT_TRUE(
      test::contains(problem_of(packet_of("libcaer_cmp", bytes_of<std::uint16_t>({0x9000}), 0, 0)), "unknown type"));
  // Each step back of a clock of 31 bits is a wrap.
  EXPECT_TRUE(test::contains(
      problem_of(packet_of("libcaer", bytes_of<std::uint64_t>({1ULL << 32, 0}), 0, std::uint64_t{1} << 62)),
      "out of range"));
  EventPacketMessage big_endian = packet_of("evt3", "", 0, 0);
  big_endian.is_bigendian = 1;
  EXPECT_TRUE(test::contains(problem_of(big_endian), "big-endian"));
}

class EncodedPackets : public testing::TestWithParam<PacketEncoding> {};

TEST_P(EncodedPackets, DecodeTogetherAndAlone) {
  const TimeNs unit = GetParam() == PacketEncoding::evt3 ? kNsPerUs : 1;
  const TimeNs start = 1'700'000'000 * kNsPerSecond;  // as seconds since 1970
  EventPacketEncoder encoder(GetParam());
  EventPacketDecoder all;
  // Longer pauses than the 16.8 s after which the sensor's clock wraps, too.
  for (const TimeNs pause : {TimeNs{0}, kNsPerMs, 20 * kNsPerSecond, 61 * kNsPerSecond}) {
    const std::vector<Event> events = random_events(5000, start + pause + 100 * pause, unit);
    EventPacketMessage packet;
    encoder.encode(events, packet);
    EXPECT_EQ(packet.header.stamp, events.front().t);
    EXPECT_EQ(decoded(all, packet).events, events) << pause;
    EventPacketDecoder alone;
    EXPECT_EQ(decoded(alone, packet).events, events) << pause;
  }
}

INSTANTIATE_TEST_SUITE_P(Encodings, EncodedPackets, testing::Values(PacketEncoding::evt3, PacketEncoding::mono));

TEST(EventPacket, LargeSensorsAreRefused) {
  const test::TemporaryDirectory base;
  const auto sink = format_named("mcap-packets").create(base.path() / "large.mcap", {});
  EXPECT_TRUE(
      test::contains(test::message_of<UserError>([&] { sink->begin(test::recording_info(2049, 10, 0, kNsPerSecond)); }),
                     "2049 x 10 px"));
}

TEST(EventPacket, LongPausesNeedNanoseconds) {
  const test::TemporaryDirectory base;
  for (const TimeUnit unit : {TimeUnit::us, TimeUnit::ns}) {
    const auto sink = format_named("mcap-packets").create(base.path() / "pause.mcap", {.unit = unit});
    sink->begin(test::recording_info(640, 480, 0, kNsPerSecond));
    const std::vector<Event> events{{kNsPerSecond, 1, 2, 1}, {100'000 * kNsPerSecond, 1, 2, 1}};
    const std::string problem = test::message_of<UserError>([&] {
      sink->write(EventsRecord{0, events});
      sink->end(true);
    });
    EXPECT_EQ(test::contains(problem, "a pause of 99999 s"), unit == TimeUnit::us) << problem;
  }
}

// A recording of a camera by its ROS driver, with triggers.
TEST(EventPacket, RecordingOfACameraIsRead) {
  const auto path = test::test_data("recordings/evt3_event_packets.bag");
  if (!path) GTEST_SKIP() << "the folder ESIM_TEST_DATA does not contain recordings/";
  const auto source = open_source(*path);
  std::size_t events = 0, triggers = 0;
  while (const Record* record = source->next()) {
    if (const auto* some = std::get_if<EventsRecord>(record)) events += some->events.size();
    triggers += std::holds_alternative<TriggerRecord>(*record) ? 1 : 0;
  }
  EXPECT_EQ(events, 343'474U);
  EXPECT_EQ(triggers, 4'157U);
  EXPECT_EQ(source->info().cameras.at(0).model.width, 640);
}

}  // namespace
}  // namespace esim

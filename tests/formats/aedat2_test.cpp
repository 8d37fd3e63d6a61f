// AEDAT 2.0, byte by byte. every_format_test.cpp covers round trips.
#include <gtest/gtest.h>

#include <map>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

const std::string kVersion = "#!AER-DAT2.0\r\n";
const std::string kDavis = kVersion + "# AEChip: eu.seebetter.ini.chips.davis.Davis346blue\r\n";
const std::string kDvs128 = kVersion + "# AEChip: ch.unizh.ini.jaer.chip.retina.DVS128\r\n";
const std::string kV2e = kVersion + "# Timestamps tick is 1 us\r\n# User name: a\r\n";

std::string words(std::initializer_list<std::uint32_t> values) {
  std::string bytes;
  for (const std::uint32_t value : values) {
    for (const int shift : {24, 16, 8, 0}) bytes.push_back(static_cast<char>(value >> shift));
  }
  return bytes;
}

/// An address of DAVIS, by the column and row of the file.
constexpr std::uint32_t davis(std::uint32_t x, std::uint32_t y, bool on) {
  return (y << 22) | (x << 12) | (on ? 1U << 11 : 0U);
}

Event at(std::int64_t us, int x, int y, int polarity) {
  return {us * kNsPerUs, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
          static_cast<std::int8_t>(polarity)};
}

struct Found {
  std::vector<Event> events{};
  std::vector<std::pair<TimeNs, TriggerKind>> triggers{};
  std::vector<std::string> not_read{};
  RecordingInfo info{};
};

class Aedat2 : public testing::Test {
 protected:
  Found read_all(const std::string& bytes, const ReadOptions& options = {}) {
    const auto source = open_source(base_.write("events", bytes), options);
    Found all;
    all.info = source->info();
    while (const Record* record = source->next()) {
      if (const auto* events = std::get_if<EventsRecord>(record)) {
        all.events.insert(all.events.end(), events->events.begin(), events->events.end());
      } else {
        const auto& trigger = std::get<TriggerRecord>(*record);
        all.triggers.emplace_back(trigger.t, trigger.kind);
      }
    }
    all.not_read = source->not_read();
    return all;
  }

  std::vector<Event> read(const std::string& bytes, const ReadOptions& options = {}) {
    return read_all(bytes, options).events;
  }

  std::string write(const std::vector<Event>& events, SensorSize sensor) {
    const auto path = base_.path() / "written.aedat";
    const auto sink = format_for(path).create(path, {});
    test::record(*sink, test::recording_info(sensor.width, sensor.height, 0, kNsPerSecond), events);
    return test::content(path);
  }

  std::string refusal(const std::string& bytes, const ReadOptions& options = {}) {
    return message_of<UserError>([&] { read(bytes, options); });
  }

  test::TemporaryDirectory base_;
};

TEST_F(Aedat2, Bytes) {
  const std::string bytes = write({at(0x01020304, 345, 259, 1), at(0xFFFFFFFF, 0, 0, -1)}, {346, 260});
  const std::string events = words({0x0000'0800, 0x01020304, 0x40D5'9000, 0xFFFFFFFF});
  EXPECT_TRUE(bytes.starts_with(kVersion));
  EXPECT_TRUE(contains(bytes, "\r\n# AEChip: eu.seebetter.ini.chips.davis.Davis346red\r\n"));
  EXPECT_TRUE(bytes.ends_with("\r\n#End Of ASCII Header\r\n" + events));
  EXPECT_EQ(test::contains(write({}, {64, 48}), "AEChip"), false) << "jAER has no such chip";
}

TEST_F(Aedat2, OnlyMicrosecondsAreKept) {
  EXPECT_EQ(read(write({{1'999, 0, 0, 1}, {2'000, 0, 0, 1}}, {64, 48})),
            (std::vector<Event>{at(1, 0, 0, 1), at(2, 0, 0, 1)}));
}

TEST_F(Aedat2, SensorsThatDoNotFitAreRefused) {
  EXPECT_NO_THROW(write({at(1, 1023, 511, 1)}, {1024, 512}));
  EXPECT_TRUE(contains(message_of<UserError>([&] { write({}, {1025, 512}); }), "holds at most 1024 x 512 px"));
  EXPECT_TRUE(contains(message_of<UserError>([&] { write({}, {1024, 513}); }), "holds at most 1024 x 512 px"));
  EXPECT_TRUE(contains(message_of<RemediableError>([&] { write({}, {0, 0}); }), "size of the sensor must be known"));
  EXPECT_TRUE(contains(message_of<UserError>([&] {
                         write({at(std::int64_t{1} << 32, 0, 0, 1)}, {64, 48});
                       }),
                       "event 0 is at 4294.967296000 s"));
}

// Without the last line of the header, too.
TEST_F(Aedat2, AFirstEventThatStartsLikeALineOfTheHeader) {
  for (int row = 140; row < 144; ++row) {
    const Event like_text = at(0x0A0A0A0A, 345 - 0x20, 259 - row, 1), next = at(0x0A0A0A0B, 3, 4, -1);
    const std::string bytes = write({like_text, next}, {346, 260});
    EXPECT_EQ(bytes[bytes.size() - 16], '#');
    EXPECT_EQ(read(bytes), (std::vector<Event>{like_text, next})) << row;
    EXPECT_EQ(read(kDavis + bytes.substr(bytes.size() - 16)), (std::vector<Event>{like_text, next})) << row;
  }
}

TEST_F(Aedat2, TheChipStatesTheSizeOfTheSensor) {
  const std::map<std::string, std::pair<int, int>> sizes = {
      {"eu.seebetter.ini.chips.davis.DAVIS240C", {240, 180}},
      {"eu.seebetter.ini.chips.DAViS.DAViS240", {240, 180}},
      {"eu.seebetter.ini.chips.davis.Davis346mini", {346, 260}},
      {"eu.seebetter.ini.chips.davis.DavisRGBW640", {640, 480}},
      {"eu.seebetter.ini.chips.davis.Davis208PixelParade", {208, 192}},
      {"DAVI346", {346, 260}},
      {"eu.seebetter.ini.chips.davis.Davis128", {128, 128}},
      {"ch.unizh.ini.jaer.chip.retina.DVS128", {128, 128}},
  };
  for (const auto& [chip, size] : sizes) {
    for (const char* end : {"\r\n", "\n", "\r\n#End Of ASCII Header\r\n", "\r\n# End of ASCII Header\r\n"}) {
      const Camera camera = read_all(kVersion + "# AEChip: " + chip + end + words({0, 7})).info.cameras[0].model;
      EXPECT_EQ(std::pair(camera.width, camera.height), size) << chip;
    }
  }
  const std::string unknown = kVersion + "# AEChip: eu.seebetter.ini.chips.davis.DavisNext\r\n" + words({0, 7});
  EXPECT_TRUE(contains(message_of<RemediableError>([&] { read(unknown); }), "size of the sensor of chip"));
  EXPECT_EQ(read(unknown, {.sensor = SensorSize{64, 48}}), std::vector<Event>{at(7, 63, 47, -1)});
  EXPECT_TRUE(contains(refusal(kVersion + "# AEChip: ch.unizh.ini.jaer.chip.retina.DVS640\r\n"),
                       "\"ch.unizh.ini.jaer.chip.retina.DVS640\" are not supported"));
}

TEST_F(Aedat2, WithoutAChipTheSizeStatesTheLayout) {
  const std::string bytes = kV2e + words({davis(345, 0, true), 7});
  const std::string message = message_of<RemediableError>([&] { read(bytes); });
  EXPECT_TRUE(contains(message, "the header names no chip"));
  EXPECT_TRUE(contains(message, "DVS128: 128 x 128 px; DAVIS: 240 x 180 or 346 x 260 px): state it"));
  EXPECT_EQ(read(bytes, {.sensor = SensorSize{346, 260}}), std::vector<Event>{at(7, 0, 259, 1)});
  EXPECT_EQ(read(kV2e + words({0x0102, 7}), {.sensor = SensorSize{128, 128}}), std::vector<Event>{at(7, 126, 126, 1)});
  EXPECT_TRUE(contains(refusal(bytes, {.sensor = SensorSize{640, 480}}), "640 x 480 px does not determine"));
}

TEST_F(Aedat2, Davis) {
  const Found all = read_all(kDavis + words({davis(0, 0, true),
                                             10,
                                             0x8000'0000,
                                             11,
                                             0x8000'03FF,
                                             11,
                                             0x8000'0800,
                                             12,  //
                                             0x400,
                                             13,
                                             0x402,
                                             14,
                                             0x403,
                                             15,
                                             0x404,
                                             16,
                                             davis(9, 0, true) | 0x400,
                                             17,
                                             davis(345, 259, false) | 0x3FF,
                                             18}));
  EXPECT_EQ(all.events, (std::vector<Event>{at(10, 345, 259, 1), at(18, 0, 0, -1)}));
  EXPECT_EQ(all.triggers, (std::vector<std::pair<TimeNs, TriggerKind>>{{13 * kNsPerUs, TriggerKind::external_pulse},
                                                                       {14 * kNsPerUs, TriggerKind::external_falling},
                                                                       {15 * kNsPerUs, TriggerKind::external_rising},
                                                                       {16 * kNsPerUs, TriggerKind::external_pulse}}));
  EXPECT_EQ(all.not_read,
            (std::vector<std::string>{"samples of frames (2)", "samples of the IMU (1)",
                                      "events that are marked as special, such as noise in files of v2e (1)"}));
}

TEST_F(Aedat2, Dvs128) {
  const Found all =
      read_all(kDvs128 + words({0x0000, 10, 0x7FFF, 11, 0x8000, 12, 0x8123, 13, 0x8000'0000, 14, 0x0203, 15}));
  EXPECT_EQ(all.events, (std::vector<Event>{at(10, 127, 127, 1), at(11, 0, 0, -1), at(15, 126, 125, -1)}));
  EXPECT_EQ(all.triggers,
            (std::vector<std::pair<TimeNs, TriggerKind>>{{12 * kNsPerUs, TriggerKind::external_falling},
                                                         {13 * kNsPerUs, TriggerKind::external_falling}}));
  EXPECT_EQ(all.not_read, std::vector<std::string>{"unknown special events (1)"});
}

TEST_F(Aedat2, OnlyTriggers) {
  std::string bytes = kDavis;
  for (std::uint32_t i = 1; i <= 100'000; ++i) bytes += words({0x403, i});
  const Found all = read_all(bytes);
  EXPECT_EQ(all.triggers.size(), 100'000U);
  EXPECT_EQ(all.info.start, kNsPerUs);
  EXPECT_TRUE(all.events.empty());
}

TEST_F(Aedat2, TheClockContinuesWhereItWraps) {
  const std::int64_t turn = std::int64_t{1} << 32;
  EXPECT_EQ(read(kDavis + words({0, 0x7FFFFFFF, 0, 0x80000001, 0, 0xFFFFFFFF, 0, 1, 0, 0xF0000000, 0, 2})),
            (std::vector<Event>{at(0x7FFFFFFF, 345, 259, -1), at(0x80000001, 345, 259, -1), at(turn - 1, 345, 259, -1),
                                at(turn + 1, 345, 259, -1), at(turn + 0xF0000000, 345, 259, -1),
                                at(2 * turn + 2, 345, 259, -1)}));
  EXPECT_TRUE(contains(refusal(kDavis + words({0, 100, 0, 99})), "sort the events by time"));
}

TEST_F(Aedat2, TimesOutOfRangeAreRefused) {
  std::string bytes = kDavis;
  for (int i = 0; i <= (1 << 20) + 1; ++i) bytes += words({0, 0xFFFFFFFF, 0, 0});
  EXPECT_TRUE(contains(refusal(bytes), "out of range"));
}

TEST_F(Aedat2, CutAnywhere) {
  const std::vector<Event> events = {at(10, 345, 259, 1), at(11, 7, 8, -1), at(0x0A23'0A23, 1, 2, 1)};
  const std::string bytes = write(events, {346, 260});
  const std::size_t header = bytes.size() - 24;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::string problem;
    std::vector<Event> found;
    try {
      found = read(bytes.substr(0, size), {.recover = [&](const std::string& what) { problem = what; }});
    } catch (const UserError& error) {
      problem = error.what();
    }
    const std::size_t whole = size < header ? 0 : (size - header) / 8;
    EXPECT_EQ(found, std::vector<Event>(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(whole))) << size;
    if (size < header) continue;
    const bool within = (size - header) % 8 != 0;
    EXPECT_TRUE(contains(problem, within ? "at byte " + std::to_string(size) + ": the file ends within an event" : ""));
    EXPECT_EQ(problem.empty(), !within) << size;
  }
}

TEST_F(Aedat2, EventsOutsideTheSensorNameTheirPlace) {
  std::string problem;
  const ReadOptions recovering{.recover = [&](const std::string& what) { problem = what; }};
  EXPECT_EQ(read(kDavis + words({0, 1, davis(346, 3, true), 2}), recovering), std::vector<Event>{at(1, 345, 259, -1)});
  EXPECT_TRUE(contains(problem, "at byte " + std::to_string(kDavis.size() + 8) +
                                    ": the event has the address (346, 3), outside the sensor of 346 x 260 px"));
  EXPECT_TRUE(contains(refusal(kDavis + words({davis(0, 260, true), 2})), "the address (0, 260)"));
}

TEST_F(Aedat2, InvalidHeadersAreRefused) {
  for (const char* version : {"1.0", "3.1", "2.1", "", "5"}) {
    const std::string message = refusal("#!AER-DAT" + std::string(version) + "\r\n" + words({0, 1}));
    EXPECT_TRUE(contains(message, "at byte 0: version \"" + std::string(version) + "\" of AEDAT is not supported"))
        << message;
    EXPECT_TRUE(contains(message, "convert the file with")) << message;
  }
  EXPECT_TRUE(
      contains(refusal(kVersion + "# " + std::string(100'000, 'x')), "at byte 14: the line of the header is too long"));
  EXPECT_TRUE(contains(refusal("#!AER-DAT"), "version \"\" of AEDAT"));
  EXPECT_TRUE(contains(refusal("#!AER-DAT" + words({0xFF410A0A, 1})), "version \"?A\" of AEDAT"));
  EXPECT_TRUE(contains(refusal(kVersion + "# AEChip: " + std::string(50'000, '\xE9') + "\r\n"),
                       "chip \"" + std::string(100, '?') + "\" are not supported"));
  EXPECT_TRUE(contains(refusal(kDavis + "# cu"), "the file ends within the header"));
  EXPECT_EQ(read(kDavis), std::vector<Event>{});
  EXPECT_TRUE(contains(refusal(kVersion + "# Sensor: 0 x 480 px\r\n"), "the header names no chip"));
  EXPECT_TRUE(contains(refusal(kVersion + "# Sensor: 99999999999 x 480 px\r\n"), "the header names no chip"));
}

TEST_F(Aedat2, LongHeaders) {
  std::string bytes = kDavis;
  for (int i = 0; i < 20'000; ++i) bytes += "#<entry key=\"DAVIS240C.bias" + std::to_string(i) + "\" value=\"µ\"/>\r\n";
  EXPECT_EQ(read(bytes + words({0, 1})), std::vector<Event>{at(1, 345, 259, -1)});
}

}  // namespace
}  // namespace esim

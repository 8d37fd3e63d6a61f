// Event Stream, byte by byte. every_format_test.cpp covers round trips.
#include <gtest/gtest.h>

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

std::string bytes_of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes.push_back(static_cast<char>(value));
  return bytes;
}

std::string header(int type, int width = 320, int height = 240) {
  return "Event Stream" + bytes_of({2, 0, 0, type, width, width >> 8, height, height >> 8});
}

constexpr int kGeneric = 0, kDvs = 1, kAtis = 2, kDisplay = 3, kColor = 4;

Event at(std::int64_t us, int x, int y, int polarity) {
  return {us * kNsPerUs, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
          static_cast<std::int8_t>(polarity)};
}

class EventStream : public testing::Test {
 protected:
  std::vector<Event> read(const std::string& bytes, const ReadOptions& options = {}) {
    const auto source = open_source(base_.write("events", bytes), options);
    sensor_ = {source->info().cameras[0].model.width, source->info().cameras[0].model.height};
    std::vector<Event> all;
    while (const Record* record = source->next()) {
      const EventSpan events = std::get<EventsRecord>(*record).events;
      all.insert(all.end(), events.begin(), events.end());
    }
    not_read_ = source->not_read();
    return all;
  }

  std::string write(const std::vector<Event>& events, SensorSize sensor = {320, 240}) {
    const auto path = base_.path() / "written.es";
    const auto sink = format_for(path).create(path, {});
    test::record(*sink, test::recording_info(sensor.width, sensor.height, 0, kNsPerSecond), events);
    return test::content(path);
  }

  std::string refusal(const std::string& bytes) {
    return message_of<UserError>([&] { read(bytes); });
  }

  test::TemporaryDirectory base_;
  SensorSize sensor_;
  std::vector<std::string> not_read_;
};

TEST_F(EventStream, Bytes) {
  EXPECT_EQ(write({at(0, 0, 239, 1), at(126, 319, 0, -1)}),
            header(kDvs) + bytes_of({0x01, 0, 0, 0, 0, 0xFC, 0x3F, 0x01, 239, 0}));
  EXPECT_EQ(write({}), header(kDvs));
  EXPECT_EQ(write({}, {65535, 65535}), header(kDvs, 65535, 65535));
}

TEST_F(EventStream, PausesAreOverflows) {
  const auto event = [](int head) { return bytes_of({head, 3, 0, 235, 0}); };
  const std::vector<Event> events = {at(127, 3, 4, -1), at(254, 3, 4, 1), at(254 + 128, 3, 4, 1),
                                     at(254 + 128 + 255, 3, 4, 1)};
  const std::string bytes =
      header(kDvs) + "\xFF" + event(0x00) + "\xFF" + event(0x01) + "\xFF" + event(0x03) + "\xFF\xFF" + event(0x03);
  EXPECT_EQ(write(events), bytes);
  EXPECT_EQ(read(bytes), events);
  const std::vector<Event> late = {at(600'000'000, 3, 4, 1)};
  EXPECT_EQ(write(late).size(), header(kDvs).size() + 600'000'000 / 127 + 5);
  EXPECT_EQ(read(write(late)), late);
}

TEST_F(EventStream, OnlyMicrosecondsAreKept) {
  EXPECT_EQ(read(write({{1'999, 0, 0, 1}, {2'000, 0, 0, 1}})), (std::vector<Event>{at(1, 0, 0, 1), at(2, 0, 0, 1)}));
}

TEST_F(EventStream, ResetsAreSkipped) {
  const std::string resets(5, '\xFE');
  EXPECT_EQ(read(header(kDvs) + resets + bytes_of({0x03, 0, 0, 0, 0}) + resets + "\xFF" + resets +
                 bytes_of({0x05, 0xFE, 0, 0xFE - 200, 0}) + resets),
            (std::vector<Event>{at(1, 0, 239, 1), at(130, 254, 239 - 54, 1)}));
  EXPECT_EQ(sensor_.width, 320);
  EXPECT_EQ(sensor_.height, 240);
}

// Byte 0: time 6 bits, polarity, and whether it is a measurement of the exposure. Overflows count 63 us each.
TEST_F(EventStream, Atis) {
  EXPECT_EQ(read(header(kAtis, 304, 240) +
                 bytes_of({0xFC, 0x06, 1, 0, 2, 0,  // a reset; ON after 1 us
                           0xFD, 0x04, 1, 0, 2, 0,  // OFF after 64 us
                           0x07, 5,    0, 6, 0, 0xF9, 5, 0, 6, 0, 0xFF, 0xFE, 0xFA, 0x2F, 0x01, 239, 0})),
            (std::vector<Event>{at(1, 1, 237, 1), at(65, 1, 237, -1), at(65 + 1 + 62 + 5 * 63 + 62, 303, 0, 1)}));
  EXPECT_EQ(not_read_, std::vector<std::string>{"exposure measurements (2)"});
}

TEST_F(EventStream, OtherStreamsAreRefused) {
  EXPECT_TRUE(contains(refusal(header(kGeneric)), "at byte 15: the stream holds generic events (0)"));
  EXPECT_TRUE(contains(refusal(header(kDisplay)), "events of a display (3)"));
  EXPECT_TRUE(contains(refusal(header(kColor)), "colour events (4)"));
  EXPECT_TRUE(contains(refusal(header(77)), "an unknown type (77)"));
  EXPECT_TRUE(contains(refusal(header(77)), "only streams of DVS (1) and ATIS (2) can be read"));
  EXPECT_TRUE(contains(refusal("Event Stream" + bytes_of({1, 2, 3, 1, 0, 0, 0, 0})), "at byte 12: version 1.2.3"));
  EXPECT_EQ(read("Event Stream" + bytes_of({2, 9, 9, 1, 1, 0, 1, 0, 3, 0, 0, 0, 0})),
            std::vector<Event>{at(1, 0, 0, 1)});
  EXPECT_TRUE(contains(refusal(header(kDvs, 0, 240)), "at byte 16: the sensor is empty: 0 x 240 px"));
}

TEST_F(EventStream, CutAnywhere) {
  const std::vector<Event> events = {at(10, 319, 239, 1), at(1000, 7, 8, -1), at(1254, 1, 2, 1)};
  const std::string bytes = write(events);
  const std::size_t start = header(kDvs).size();
  ASSERT_EQ(bytes.size(), start + 5 + (7 + 5) + (2 + 5)) << "overflows and events";
  for (std::size_t size = 12; size < bytes.size(); ++size) {
    const std::string at_byte = "at byte " + std::to_string(size) + ": the file ends within ";
    if (size < start) {
      EXPECT_TRUE(contains(refusal(bytes.substr(0, size)), at_byte + "the "));
      continue;
    }
    const std::size_t used = size - start, whole = used < 5 ? 0 : used < 17 ? 1 : 2;
    const bool within = (used > 0 && used < 5) || (used > 12 && used < 17) || used > 19;
    std::string problem;
    const auto note = [&](const std::string& what) { problem = what; };
    EXPECT_EQ(read(bytes.substr(0, size), {.recover = note}),
              std::vector<Event>(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(whole)));
    EXPECT_TRUE(contains(problem, within ? at_byte + "an event" : "")) << size;
    EXPECT_EQ(problem.empty(), !within) << size;
  }
}

TEST_F(EventStream, EventsOutsideTheSensorNameTheirPlace) {
  const std::string good = bytes_of({2, 0, 0, 0, 0});
  std::string problem;
  const auto note = [&](const std::string& what) { problem = what; };
  EXPECT_EQ(read(header(kDvs) + good + bytes_of({2, 0x40, 1, 0, 0}), {.recover = note}),
            std::vector<Event>{at(1, 0, 239, -1)});
  EXPECT_TRUE(contains(problem, "at byte 25: the event is at (320, 0), outside the sensor of 320 x 240 px"));
  EXPECT_TRUE(contains(refusal(header(kDvs) + bytes_of({2, 0, 0, 240, 0})), "at byte 20: the event is at (0, 240)"));
}

TEST_F(EventStream, WhatDoesNotFitIsRefused) {
  EXPECT_TRUE(contains(message_of<UserError>([&] { write({}, {65536, 1}); }), "holds at most 65535 x 65535 px"));
  EXPECT_TRUE(contains(message_of<RemediableError>([&] { write({}, {0, 0}); }), "size of the sensor must be known"));
  EXPECT_TRUE(contains(message_of<UserError>([&] { write({at(std::int64_t{1} << 34, 0, 0, 1)}); }), "event 0 is at"));
}

}  // namespace
}  // namespace esim

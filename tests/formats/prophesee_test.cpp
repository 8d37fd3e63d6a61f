// Prophesee's files, word by word. every_format_test.cpp covers round trips.
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <map>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

const std::string kEvt3 = "% evt 3.0\n% end\n", kEvt2 = "% evt 2.0\n% end\n", kDat = "% Version 2\n\x0C\x08";

template <typename Word>
std::string bytes_of(std::initializer_list<Word> words) {
  std::string bytes(words.size() * sizeof(Word), '\0');
  std::memcpy(bytes.data(), words.begin(), bytes.size());
  return bytes;
}
std::string words16(std::initializer_list<std::uint16_t> words) { return bytes_of(words); }
std::string words32(std::initializer_list<std::uint32_t> words) { return bytes_of(words); }
std::string words64(std::initializer_list<std::uint64_t> words) { return bytes_of(words); }

class Prophesee : public testing::Test {
 protected:
  std::vector<Event> read(const std::string& bytes, SensorSize* sensor = nullptr, const ReadOptions& options = {}) {
    const auto source = open_source(base_.write("events", bytes), options);
    if (sensor != nullptr) {
      const Camera& camera = source->info().cameras[0].model;
      *sensor = {camera.width, camera.height};
    }
    std::vector<Event> all;
    while (const Record* record = source->next()) {
      const EventSpan events = std::get<EventsRecord>(*record).events;
      all.insert(all.end(), events.begin(), events.end());
    }
    return all;
  }

  std::string write(const std::string& format, const std::vector<Event>& events, std::size_t portion = 1000,
                    SensorSize sensor = {2000, 1000}) {
    const auto path = base_.path() / "written";
    const auto sink = format_named(format).create(path, {});
    sink->begin(test::recording_info(sensor.width, sensor.height, 0, kNsPerSecond));
    test::write_in_batches(*sink, events, portion);
    sink->end(true);
    return test::content(path);
  }

  /// The content without the header.
  std::vector<std::uint16_t> evt3_words(const std::vector<Event>& events, std::size_t portion = 1000) {
    const std::string bytes = write("evt3", events, portion);
    const std::size_t start = bytes.find("% end\n") + 6;
    std::vector<std::uint16_t> words((bytes.size() - start) / 2);
    std::memcpy(words.data(), bytes.data() + start, 2 * words.size());
    return words;
  }

  test::TemporaryDirectory base_;
};

Event at(std::int64_t us, int x, int y, int polarity) {
  return {us * kNsPerUs, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
          static_cast<std::int8_t>(polarity)};
}

TEST_F(Prophesee, HeaderIsThatOfProphesee) {
  EXPECT_TRUE(write("evt3", {})
                  .starts_with("% camera_integrator_name esim\n% evt 3.0\n% format EVT3;height=1000;width=2000\n% "
                               "geometry 2000x1000\n"));
  EXPECT_TRUE(contains(write("evt2", {}), "% evt 2.0\n% format EVT2;height=1000;width=2000\n"));
  EXPECT_EQ(write("dat", {}), "% Data file containing CD events\n% Version 2\n% Width 2000\n% Height 1000\n\x0C\x08");
  EXPECT_FALSE(contains(write("evt3", {}, 1, {}), "geometry")) << "of unknown size";
}

TEST_F(Prophesee, HeadersOfAllKinds) {
  const std::string events = words16({0x8000, 0x6001, 0x0002, 0x2803});
  const std::vector<Event> expected = {at(1, 3, 2, 1)};
  const std::map<std::string, SensorSize> headers = {
      {"% evt 3.0\n", {0, 0}},
      {"% format EVT3\n% end\n", {0, 0}},
      {"% date 2023-03-29 16:37:46\n% format EVT3;height=720;width=1280\n% generation 4.2\n% end\n", {1280, 720}},
      {"% evt 3.0\r\n% geometry 640x480\r\n% end\r\n", {640, 480}},
      {"% evt 3.0 \n% Width 320\n% Height 240\n% remark 100 % of it \n%  \n% end\n", {320, 240}},
      {"% evt 3.0\n% geometry 0x480\n% end\n", {0, 0}},
  };
  for (const auto& [header, size] : headers) {
    SensorSize sensor;
    EXPECT_EQ(read(header + events, &sensor), expected) << header;
    EXPECT_EQ(sensor.width, size.width) << header;
    EXPECT_EQ(sensor.height, size.height) << header;
  }
  EXPECT_EQ(read(kEvt3), std::vector<Event>{});
}

TEST_F(Prophesee, SensorsOfTheUserReplaceThoseOfTheFile) {
  SensorSize sensor;
  read(kEvt3, &sensor, {.sensor = SensorSize{64, 48}});
  EXPECT_EQ(sensor.width, 64);
}

TEST_F(Prophesee, Evt3WritesWhatChanges) {
  EXPECT_EQ(evt3_words({at(5, 7, 9, 1), at(5, 7, 10, -1), at(6, 2, 10, -1)}),
            (std::vector<std::uint16_t>{0x8000, 0x6005, 0x0009, 0x2807, 0x000A, 0x2007, 0x6006, 0x2002}));
  EXPECT_EQ(
      evt3_words({at(3 * 4096 + 1, 0, 0, 1), at(4 * 4096 + 1, 0, 0, 1)}),
      (std::vector<std::uint16_t>{0x8000, 0x8001, 0x8002, 0x8003, 0x6001, 0x0000, 0x2800, 0x8004, 0x6001, 0x2800}))
      << "every value of the high bits; low bits after them, even the same";
}

TEST_F(Prophesee, Evt3VectorsWhereEventsAreDense) {
  EXPECT_EQ(evt3_words({at(1, 4, 0, 1), at(1, 9, 0, 1)}),
            (std::vector<std::uint16_t>{0x8000, 0x6001, 0x0000, 0x2804, 0x2809}));
  EXPECT_EQ(evt3_words({at(1, 4, 0, 1), at(1, 5, 0, 1), at(1, 11, 0, 1)}),
            (std::vector<std::uint16_t>{0x8000, 0x6001, 0x0000, 0x3804, 0x5083}));
  std::vector<Event> row;
  for (int x = 100; x < 132; ++x) row.push_back(at(1, x, 3, -1));
  EXPECT_EQ(evt3_words(row), (std::vector<std::uint16_t>{0x8000, 0x6001, 0x0003, 0x3064, 0x4FFF, 0x4FFF, 0x50FF}));
  EXPECT_EQ(evt3_words({at(1, 5, 0, 1), at(1, 6, 0, 1), at(1, 6, 0, 1), at(1, 7, 0, -1)}),
            (std::vector<std::uint16_t>{0x8000, 0x6001, 0x0000, 0x2805, 0x2806, 0x2806, 0x2007}))
      << "a pixel again, another polarity";
}

TEST_F(Prophesee, Evt3BytesDoNotDependOnPortions) {
  std::vector<Event> events;
  std::mt19937 random(3);
  for (int us = 0; us < 200; ++us) {
    for (int x = 0; x < 60; ++x) {
      if (random() % 4 != 0) events.push_back(at(us, x, us % 3, random() % 16 == 0 ? 1 : -1));
    }
  }
  const auto words = evt3_words(events);
  EXPECT_EQ(evt3_words(events, 1), words);
  EXPECT_EQ(evt3_words(events, 7), words);
  EXPECT_LT(words.size(), events.size() * 3 / 4);
}

TEST_F(Prophesee, Evt3ReadsAllWords) {
  const std::string words = words16({
      0x0005, 0x2801, 0x6003, 0x4FFF,          // no time yet
      0x8001, 0x6002, 0x2810,                  // row 5, column 16
      0x3820, 0x4801, 0x5081, 0x4001,          // a base; pixels 0 and 11 from it; 12 and 19; 20
      0xA001, 0x7123, 0xF123, 0xE001, 0x7000,  // triggers, other types and their continuations
      0x1FFF, 0x9FFF, 0xBFFF, 0xCFFF, 0xDFFF,  // reserved
      0x0FFF, 0x2002,                          // the second camera's row 2047
      0x8001, 0x2003, 0x6003, 0x2004,          // the time again
  });
  EXPECT_EQ(read(kEvt3 + words),
            (std::vector<Event>{at(4098, 16, 5, 1), at(4098, 32, 5, 1), at(4098, 43, 5, 1), at(4098, 44, 5, 1),
                                at(4098, 51, 5, 1), at(4098, 52, 5, 1), at(4098, 2, 2047, -1), at(4098, 3, 2047, -1),
                                at(4099, 4, 2047, -1)}));
}

TEST_F(Prophesee, ClocksTurn) {
  EXPECT_EQ(read(kEvt3 + words16({0x8FFF, 0x6FFF, 0x2801, 0x8000, 0x6000, 0x2802, 0x8FFF, 0x8001, 0x2803})),
            (std::vector<Event>{at((1 << 24) - 1, 1, 0, 1), at(1 << 24, 2, 0, 1), at((2 << 24) + 4096, 3, 0, 1)}));
  const std::int64_t turn = std::int64_t{1} << 34;
  EXPECT_EQ(read(kEvt2 + words32({0x8FFFFFFF, 0x1FC00801, 0x80000000, 0x00400801})),
            (std::vector<Event>{at(turn - 1, 1, 1, 1), at(turn + 1, 1, 1, -1)}));
  EXPECT_EQ(read(kDat + words32({0xFFFFFFFF, 1, 1, 1})),
            (std::vector<Event>{at(0xFFFFFFFF, 1, 0, -1), at((std::int64_t{1} << 32) + 1, 1, 0, -1)}));
}

TEST_F(Prophesee, ALittleStepBackOfTheClockIsNoTurn) {
  const std::string words = words16({0x8010, 0x6000, 0x2801, 0x800F, 0x6000, 0x2802});
  EXPECT_TRUE(contains(message_of<UserError>([&] { read(kEvt3 + words); }), "sort the events by time"));
}

TEST_F(Prophesee, BigEndian) {
  EXPECT_EQ(read("% format EVT3;endianness=big\n% end\n" + std::string("\x80\x00\x60\x01\x00\x02\x28\x03", 8)),
            (std::vector<Event>{at(1, 3, 2, 1)}));
  EXPECT_EQ(read("% format EVT2;endianness=big\n% end\n" + std::string("\x80\x00\x00\x01\x10\x40\x18\x02", 8)),
            (std::vector<Event>{at(65, 3, 2, 1)}));
}

TEST_F(Prophesee, Evt2) {
  EXPECT_EQ(read(kEvt2 + words32({0x10001002, 0x80000001, 0x10401802, 0xA0000000, 0xE0000000, 0xF0000000, 0x0FFFFFFF})),
            (std::vector<Event>{at(65, 3, 2, 1), at(127, 2047, 2047, -1)}))
      << "the first has no time, the others are not events";
}

TEST_F(Prophesee, Evt21InBothOrdersOfItsHalves) {
  const std::uint64_t time = 0x80000001'00000000, on = 0x10410002'80000003, off = 0x00410002'00000001;
  const std::vector<Event> expected = {at(65, 32, 2, 1), at(65, 33, 2, 1), at(65, 63, 2, 1), at(65, 32, 2, -1)};
  EXPECT_EQ(read("% format EVT21;endianness=little\n% end\n" + words64({time, on, off})), expected);
  EXPECT_EQ(read("% format EVT21;height=720;width=1280;endianness=legacy\n% end\n" +
                 words64({std::rotl(time, 32), std::rotl(on, 32), std::rotl(off, 32)})),
            expected);
}

TEST_F(Prophesee, DatOfOthers) {
  const std::string events = words32({10, 3 | (2 << 14) | (1U << 28), 11, 16383 | (16383 << 14)});
  const std::vector<Event> expected = {at(10, 3, 2, 1), at(11, 16383, 16383, -1)};
  EXPECT_EQ(read(kDat + events), expected);
  SensorSize sensor;
  EXPECT_EQ(read("% Data file containing Event2D events.\n% Version 2\n" + std::string("\0\x08", 2) + events, &sensor),
            expected);
  EXPECT_EQ(sensor.width, 0) << "as in N-CARS";
  EXPECT_TRUE(contains(message_of<UserError>([&] { read("% Version 2\n\x0E\x08" + events); }), "events of type 14"));
}

TEST_F(Prophesee, WhatDoesNotFitIsRefused) {
  for (const char* format : {"evt3", "evt2", "dat"}) {
    const auto refusal = [&](std::vector<Event> events, SensorSize sensor = {}) {
      const std::string message = message_of<UserError>([&] { write(format, events, 1, sensor); });
      EXPECT_TRUE(contains(message, "written: event ")) << message;
      return message;
    };
    const Event good = at(0, 0, 0, 1);
    EXPECT_TRUE(contains(refusal({{-1, 0, 0, 1}}), "event 0 is at -0.000000001 s"));
    EXPECT_TRUE(contains(refusal({{-1, 0, 0, 1}}), "choose another format"));
    const TimeNs latest = format_named(format).max_time;
    EXPECT_TRUE(contains(refusal({good, good, {latest + 1, 0, 0, 1}}), "event 2 is at ")) << format;
    EXPECT_NO_THROW(write(format, {good, {latest, 0, 0, 1}})) << format;
    const int extent = format_named(format).max_width;
    EXPECT_TRUE(contains(refusal({good, at(0, extent, 7, 1)}), "event 1 is at (" + std::to_string(extent) + ", 7)"));
    EXPECT_TRUE(contains(refusal({at(0, 30, 7, 1)}, {30, 8}), "outside the sensor of 30 x 8 px"));
  }
}

TEST_F(Prophesee, CutWordsNameTheirPlace) {
  const std::string bytes = kEvt3 + words16({0x8000, 0x6001, 0x2803});
  std::string problem;
  const auto note = [&](const std::string& what) { problem = what; };
  EXPECT_EQ(read(bytes + "x", nullptr, {.recover = note}), std::vector<Event>{at(1, 3, 0, 1)});
  EXPECT_TRUE(contains(problem, "at byte " + std::to_string(bytes.size()) + ": the file ends within a word"))
      << problem;
}

}  // namespace
}  // namespace esim

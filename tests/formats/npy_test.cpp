// NumPy arrays as other programs write them. every_format_test.cpp covers round trips.
#include <gtest/gtest.h>

#include <cstring>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

std::string npy(const std::string& descr, const std::string& shape, const std::string& data, char version = 1) {
  const std::string description = "{'descr': " + descr + ", 'fortran_order': False, 'shape': " + shape + ", }\n";
  std::string length(version == 1 ? 2 : 4, '\0');
  length[0] = static_cast<char>(description.size());
  return "\x93NUMPY" + std::string{version, '\0'} + length + description + data;
}

std::string bytes_of(auto... numbers) {
  std::string bytes;
  const auto add = [&](auto number) {
    char raw[sizeof(number)];
    std::memcpy(raw, &number, sizeof(number));
    bytes.append(raw, sizeof(number));
  };
  (add(numbers), ...);
  return bytes;
}

using U8 = std::uint8_t;
using U16 = std::uint16_t;
using I64 = std::int64_t;

const std::string kDescr = "[('t', '<i8'), ('x', '<u2'), ('y', '<u2'), ('p', '|u1')]";

class Npy : public testing::Test {
 protected:
  std::vector<Event> read(const std::string& bytes, const ReadOptions& options = {}) {
    const auto source = open_source(base_.write("events.npy", bytes), options);
    std::vector<Event> all;
    while (const Record* record = source->next()) {
      const EventSpan events = std::get<EventsRecord>(*record).events;
      all.insert(all.end(), events.begin(), events.end());
    }
    return all;
  }
  std::string refusal(const std::string& bytes) {
    return message_of<UserError>([&] { read(bytes); });
  }

  test::TemporaryDirectory base_;
};

TEST_F(Npy, WhatIsWritten) {
  const auto path = base_.path() / "written.npy";
  const auto write = [&](TimeUnit unit) {
    test::record(*format_for(path).create(path, {.unit = unit}),
                 test::recording_info(64, 48, -kNsPerSecond, kNsPerSecond), {{-1, 1, 2, -1}, {1999, 3, 4, 1}});
    return test::content(path);
  };
  const std::string us = write(TimeUnit::us), ns = write(TimeUnit::ns);
  EXPECT_TRUE(contains(us, "{'descr': " + kDescr + ", 'fortran_order': False, 'shape': (2,), }  "));
  EXPECT_EQ(us.substr(192), bytes_of(I64{-1}, U16{1}, U16{2}, U8{0}, I64{1}, U16{3}, U16{4}, U8{1})) << "rounded down";
  EXPECT_TRUE(contains(ns, "('t', '<m8[ns]')"));
  EXPECT_EQ(ns.substr(192), bytes_of(I64{-1}, U16{1}, U16{2}, U8{0}, I64{1999}, U16{3}, U16{4}, U8{1}));
}

TEST_F(Npy, RecordsOfOthers) {
  const std::vector<Event> expected = {{5'000'000, 1, 2, 1}};
  EXPECT_EQ(read(npy(kDescr, "(1,)", bytes_of(I64{5000}, U16{1}, U16{2}, U8{1}))), expected);
  EXPECT_EQ(read(npy(kDescr, "(1, 1)", bytes_of(I64{5000}, U16{1}, U16{2}, U8{1}), 2)), expected);
  EXPECT_EQ(read(npy("[('x', '|i1'), ('Y', '|u1'), (('polarity', 'p'), '|b1'), ('', '|V3'), ('timestamp', '<u4')]",
                     "(1,)", bytes_of(U8{1}, U8{2}, U8{1}, U8{9}, U16{9}, std::uint32_t{5000}))),
            expected)
      << "any order, titles, gaps";
  EXPECT_EQ(read(npy("[('ts','<f8'),('x','<f4'),('y','<f4'),('pol','<i2')]", "(1,)",
                     bytes_of(0.005, 1.0F, 2.0F, std::int16_t{1}))),
            expected)
      << "s";
  EXPECT_EQ(read(npy("[('t','<M8[ms]'),('x','>u2'),('y','>u2'),('p','|i1'),('more','<f2',(2,2))]", "(1,)",
                     bytes_of(I64{5}, U16{256}, U16{512}, U8{1}, I64{0}))),
            expected)
      << "both orders of bytes";
  EXPECT_EQ(read(npy(kDescr, "(0,)", "")), std::vector<Event>{});
}

TEST_F(Npy, OnIsAbove0) {
  const std::string descr = "[('t','<i8'),('x','|u1'),('y','|u1'),('p','|i1')]";
  const std::string data =
      bytes_of(I64{1}, U8{1}, U8{1}, U8{255}, I64{2}, U8{1}, U8{1}, U8{0}, I64{3}, U8{1}, U8{1}, U8{1});
  const auto events = read(npy(descr, "(3,)", data));
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].polarity, -1);
  EXPECT_EQ(events[1].polarity, -1);
  EXPECT_EQ(events[2].polarity, 1);
}

TEST_F(Npy, WhatCannotBeReadIsSaid) {
  EXPECT_TRUE(contains(refusal(npy("'<f8'", "(2, 4)", std::string(64, '\0'))), "it has no numbers \"t\""));
  EXPECT_TRUE(contains(refusal(npy("[('x','<u2'),('y','<u2'),('t','<i8')]", "(0,)", "")), "it has no numbers \"p\""));
  EXPECT_TRUE(
      contains(refusal(npy("[('t','|O'),('x','<u2'),('y','<u2'),('p','|u1')]", "(0,)", "")), "not supported: |O"));
  EXPECT_TRUE(contains(refusal(npy(kDescr, "(2, 2)", "")), "more than one dimension"));
  EXPECT_TRUE(contains(refusal(npy("[" + std::string(50, '('), "(1,)", "")), "damaged"));
  EXPECT_TRUE(contains(refusal(npy("[('t','<i8'),('x','|i1'),('y','|u1'),('p','|u1')]", "(1,)",
                                   bytes_of(I64{1}, U8{255}, U8{0}, U8{0}))),
                       "event 0 has an invalid time, position or polarity"));
  EXPECT_TRUE(contains(refusal(npy("[('t','<f8'),('x','|u1'),('y','|u1'),('p','|u1')]", "(1,)",
                                   bytes_of(std::numeric_limits<double>::quiet_NaN(), U8{0}, U8{0}, U8{0}))),
                       "event 0 has an invalid time"));
}

TEST_F(Npy, CountsAreNotTrusted) {
  const std::string event = bytes_of(I64{5000}, U16{1}, U16{2}, U8{1});
  std::string problem;
  const auto note = [&](const std::string& what) { problem = what; };
  EXPECT_EQ(read(npy(kDescr, "(18446744073709551615,)", event + "xx"), {.recover = note}).size(), 1U);
  EXPECT_TRUE(contains(problem, "it ends after 1 of 18446744073709551615 events")) << problem;
  EXPECT_TRUE(
      contains(refusal(npy("[('t','<i8'),('x','<u2'),('y','<u2'),('p','|u1'),('v','|V9999999999')]", "(9,)", "")),
               "events.npy"));
}

TEST_F(Npy, ACutNpzIsToldAsThat) {
  const auto path = base_.path() / "whole.npz";
  test::record(*format_for(path).create(path, {}), test::recording_info(64, 48, 0, kNsPerSecond),
               test::random_events(1000, 64, 48, 0, kNsPerSecond));
  const std::string bytes = test::content(path);
  const auto cut = base_.write("cut.npz", bytes.substr(0, bytes.size() - 30));
  const std::string problem = test::message_of<UserError>([&] { open_source(cut); });
  EXPECT_TRUE(contains(problem, "cut.npz")) << problem;
  EXPECT_TRUE(contains(problem, "the zip is truncated")) << problem;
}

TEST_F(Npy, CompressionOfNpz) {
  const auto events = test::random_events(50'000, 64, 48, 0, kNsPerSecond);
  std::uintmax_t sizes[2];
  for (const Compression compression : {Compression::none, Compression::gzip}) {
    const auto path = base_.path() / "events.npz";
    test::record(*format_for(path).create(path, {TimeUnit::ns, compression}),
                 test::recording_info(64, 48, 0, kNsPerSecond), events);
    sizes[compression == Compression::gzip] = std::filesystem::file_size(path);
    const auto source = open_source(path);
    EXPECT_EQ(source->info().cameras[0].model.width, 64);
    std::vector<Event> all;
    while (const Record* record = source->next()) {
      const EventSpan portion = std::get<EventsRecord>(*record).events;
      all.insert(all.end(), portion.begin(), portion.end());
    }
    EXPECT_EQ(all, events);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(base_.path()), std::filesystem::directory_iterator()),
              1)
        << "no columns are left";
  }
  EXPECT_LT(sizes[1], sizes[0] / 2);
}

}  // namespace
}  // namespace esim

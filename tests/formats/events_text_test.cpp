#include "esim/formats/text/events_text.h"

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;
using test::TemporaryDirectory;

std::vector<Event> read_all(const std::filesystem::path& path, std::size_t block = 1000) {
  EventsTextReader reader(path);
  std::vector<Event> all, events;
  while (reader.read(events, block)) {
    EXPECT_LE(events.size(), block);
    all.insert(all.end(), events.begin(), events.end());
  }
  return all;
}

TEST(EventsText, RoundTripIsExact) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "events.txt";
  for (const TimeNs start : {TimeNs{0}, TimeNs{-1'500'000'000}, TimeNs{1'700'000'000'123'456'789}}) {
    const auto events = test::random_events(50'000, 1280, 720, start, start + 3 * kNsPerSecond);
    EventsTextWriter writer(path, 0);
    test::record(writer, test::recording_info(1280, 720, start, start + 3 * kNsPerSecond), events);
    EXPECT_EQ(read_all(path), events);
    EXPECT_EQ(read_all(path, 7), events);
  }
}

TEST(EventsText, Lines) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "events.txt";
  EventsTextWriter writer(path, 0);
  test::record(writer, test::recording_info(500, 500, -kNsPerSecond, kNsPerSecond),
               {{-1, 3, 4, -1}, {0, 0, 0, 1}, {1'234'567'890, 345, 259, 1}});
  EXPECT_EQ(test::content(path), "-0.000000001 3 4 0\n0.000000000 0 0 1\n1.234567890 345 259 1\n");
}

TEST(EventsText, ReadsWhatOthersWrite) {
  const TemporaryDirectory directory;
  const auto path =
      directory.write("events.txt", "# t x y p\r\n\r\n0.5 1 2 1\r\n\n 1.25\t3  4 -1 \n2 5 6 0\n3.1234567899 7 8 1");
  EXPECT_EQ(
      read_all(path),
      (std::vector<Event>{
          {500'000'000, 1, 2, 1}, {1'250'000'000, 3, 4, -1}, {2'000'000'000, 5, 6, -1}, {3'123'456'789, 7, 8, 1}}));
  EXPECT_TRUE(read_all(directory.write("empty.txt", "")).empty());
}

TEST(EventsText, ErrorsNameTheLine) {
  const TemporaryDirectory directory;
  const auto message = [&](const std::string& line) {
    const auto path = directory.write("events.txt", "# header\n0.5 1 2 1\n" + line);
    const auto text = message_of<UserError>([&] { read_all(path); });
    EXPECT_TRUE(contains(text, path.string() + ", line 3: "));
    return text;
  };
  for (const char* line :
       {"1.0 2 3",          "1.0 2 3 1 5",      "x 1 2 1",     "1.0.0 1 2 1", "1e3 1 2 1", "nan 1 2 1",
        ".5 1 2 1",         "- 1 2 1",          "--1 1 2 1",   "-+1 1 2 1",   "1,0 1 2 1", "99999999999999999999 1 2 1",
        "9223372036 1 2 1", "1 -1 2 1",         "1 65536 2 1", "1 1.5 2 1",   "1 2 x 1",   "1 2 3 2",
        "1 2 3 ON",         "0.499999999 1 2 1"}) {
    EXPECT_NE(message(line), "nothing was thrown") << line;
  }
  EXPECT_TRUE(contains(message("1.0 2 3"), "expected four numbers: t x y p"));
  EXPECT_TRUE(contains(message("0.4 1 2 1"), "before that of the line above"));
  EXPECT_TRUE(contains(message(std::string(1'000'000, '1')), "the line is too long"));
  EXPECT_TRUE(contains(message(std::string("\0\0\0", 3)), "expected four numbers"));
  EXPECT_TRUE(contains(message_of<UserError>([] { EventsTextReader("/nonexistent"); }), "No such file"));
  EXPECT_TRUE(contains(message_of<UserError>([] { EventsTextReader("/tmp"); }), "folder"));
}

TEST(EventsText, FullDisk) {
  EventsTextWriter writer("/dev/full", 0);
  const auto events = test::random_events(100'000, 64, 48, 0, kNsPerSecond);
  EXPECT_EQ(
      message_of<OutputError>([&] { test::record(writer, test::recording_info(64, 48, 0, kNsPerSecond), events); }),
      "cannot write /dev/full: No space left on device");
}

TEST(NumberText, Grouping) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(std::numeric_limits<std::uint64_t>::max()), "18,446,744,073,709,551,615");
}

TEST(NumberText, ExtremeTimes) {
  std::string text;
  append_seconds(text, std::numeric_limits<TimeNs>::min());
  text += " ";
  append_seconds(text, std::numeric_limits<TimeNs>::max());
  EXPECT_EQ(text, "-9223372036.854775808 9223372036.854775807");
}

}  // namespace
}  // namespace esim

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

std::vector<Event> read(const std::filesystem::path& path) {
  std::vector<Event> all;
  const auto source = open_source(path);
  while (const Record* record = source->next()) {
    const EventSpan events = std::get<EventsRecord>(*record).events;
    all.insert(all.end(), events.begin(), events.end());
  }
  return all;
}

TEST(Nmnist, Bytes) {
  const test::TemporaryDirectory base;
  const auto path = base.path() / "events.bin";
  const std::vector<Event> events = {{0x123456 * kNsPerUs, 3, 239, 1}, {0x7FFFFF * kNsPerUs, 255, 0, -1}};
  test::record(*format_for(path).create(path, {}), test::recording_info(256, 240, 0, 8 * kNsPerSecond), events);
  EXPECT_EQ(test::content(path), std::string("\x03\xEF\x92\x34\x56\xFF\0\x7F\xFF\xFF", 10));
  EXPECT_EQ(read(path), events);
}

TEST(Nmnist, Row240DelaysWhatFollows) {
  const test::TemporaryDirectory base;
  const auto path = base.write("events.bin", std::string("\1\2\0\0\5\0\xF0\0\0\0\1\2\x80\0\1", 15));
  EXPECT_EQ(read(path), (std::vector<Event>{{5 * kNsPerUs, 1, 2, -1}, {8193 * kNsPerUs, 1, 2, 1}}));
}

TEST(Nmnist, OtherFilesAreNotTakenForIt) {
  const test::TemporaryDirectory base;
  const std::string later("\1\2\0\0\5", 5), earlier("\1\2\0\0\4", 5);
  EXPECT_EQ(format_of(base.write("a.bin", earlier + later)).name, "nmnist");
  EXPECT_THROW(format_of(base.write("b.bin", later + earlier)), UserError) << "times decrease";
  EXPECT_THROW(format_of(base.write("c.bin", later + '\0')), UserError) << "not five bytes each";
  EXPECT_THROW(format_of(base.write("d.raw", later)), UserError) << "another name";
}

TEST(Nmnist, LaterTimesAreRefused) {
  const test::TemporaryDirectory base;
  const auto sink = format_named("nmnist").create(base.path() / "events.bin", {});
  const std::string message = test::message_of<UserError>([&] {
    test::record(*sink, test::recording_info(64, 48, 0, kNsPerSecond), {{8'388'608 * kNsPerUs, 1, 2, 1}});
  });
  EXPECT_TRUE(test::contains(message, "event 0 is at 8.388608000 s")) << message;
}

}  // namespace
}  // namespace esim

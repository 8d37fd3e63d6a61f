#include "esim/formats/inspect.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "esim/core/error.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/text/events_text.h"
#include "esim/recording/recording_directory.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::message_of;

class InspectTest : public testing::Test {
 protected:
  void write_events(const fs::path& path) {
    EventsHdf5Writer writer(path, 0);
    test::record(writer, info_, events_);
  }

  test::TemporaryDirectory base_;
  fs::path out_ = base_.path() / "out";
  RecordingInfo info_ = test::recording_info(64, 48, 0, 2 * kNsPerSecond);
  std::vector<Event> events_ = {{500'000'000, 1, 2, 1}, {500'000'000, 2, 2, 1}, {1'500'000'000, 3, 2, -1}};
};

TEST_F(InspectTest, CompleteRecording) {
  RecordingDirectory directory(out_, false);
  write_events(directory.path() / "events.h5");
  fs::create_directory(directory.path() / "images");
  std::ofstream(directory.path() / "images" / "000000.png") << "1234567890";
  std::ofstream(directory.path() / "images" / "timestamps.txt") << "12345";
  directory.finish(R"({"status": "complete", "seconds": 3.5, "cameras": [1, 2]})");

  const Inspection found = inspect(out_ / "");
  EXPECT_EQ(found.status, RecordingStatus::complete);
  ASSERT_EQ(found.cameras.size(), 1u);
  EXPECT_EQ(found.cameras[0].events, 3u);
  EXPECT_EQ(found.cameras[0].on, 2u);
  EXPECT_EQ(found.cameras[0].off(), 1u);
  EXPECT_EQ(found.cameras[0].width, 64);
  EXPECT_EQ(found.cameras[0].first, 500'000'000);
  EXPECT_EQ(found.cameras[0].last, 1'500'000'000);
  EXPECT_DOUBLE_EQ(found.cameras[0].mean_rate_hz(), 3.0);
  ASSERT_EQ(found.files.size(), 3u);
  EXPECT_EQ(found.files[1].name, "images/");
  EXPECT_EQ(found.files[1].bytes, 15u);
  EXPECT_EQ(found.files[1].files, 2u);

  const std::string text = describe(found);
  for (const char* part : {"complete", "64 x 48 px", "2 (66.7 %)", "0.500000 s to 1.500000 s", "3 ev/s", "events.h5"}) {
    EXPECT_TRUE(contains(text, part));
  }
}

TEST_F(InspectTest, InterruptedRecordingWithTwoCameras) {
  RecordingDirectory directory(out_, false);
  for (const char* camera : {"right", "left"}) {
    fs::create_directory(directory.path() / camera);
    write_events(directory.path() / camera / "events.h5");
  }
  directory.finish(R"({"status": "interrupted", "reason": "stopped by Ctrl-C"})");
  const Inspection found = inspect(out_);
  EXPECT_EQ(found.status, RecordingStatus::interrupted);
  ASSERT_EQ(found.cameras.size(), 2u);
  EXPECT_EQ(found.cameras[0].camera, "left");
  EXPECT_TRUE(contains(describe(found), "stopped by Ctrl-C"));
  EXPECT_TRUE(contains(describe(found), "right/events.h5"));
}

TEST_F(InspectTest, KilledAndRunning) {
  const pid_t child = fork();
  if (child == 0) {
    RecordingDirectory directory(out_, false);
    EventsHdf5Writer writer(directory.path() / "events.h5", 0);
    writer.begin(info_);
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(inspect(out_).status, RecordingStatus::killed);
  EXPECT_EQ(inspect(out_).path, incomplete_path(out_));
  EXPECT_EQ(inspect(incomplete_path(out_)).status, RecordingStatus::killed);
  EXPECT_TRUE(contains(describe(inspect(out_)), "killed"));

  RecordingDirectory directory(out_, true);
  EXPECT_EQ(inspect(out_).status, RecordingStatus::running);
}

TEST_F(InspectTest, SingleFiles) {
  write_events(base_.path() / "a.h5");
  EventsTextWriter writer(base_.path() / "a.txt", 0);
  test::record(writer, info_, events_);
  for (const char* name : {"a.h5", "a.txt"}) {
    const Inspection found = inspect(base_.path() / name);
    ASSERT_EQ(found.cameras.size(), 1u);
    EXPECT_EQ(found.cameras[0].events, 3u);
    EXPECT_EQ(found.cameras[0].on, 2u);
    EXPECT_EQ(found.cameras[0].last, 1'500'000'000);
    EXPECT_FALSE(describe(found).empty());
  }
  EXPECT_EQ(inspect(base_.path() / "a.h5").status, RecordingStatus::complete);
  EXPECT_EQ(inspect(base_.path() / "a.txt").status, RecordingStatus::unknown);
}

TEST_F(InspectTest, DamageIsReportedNotFatal) {
  RecordingDirectory directory(out_, false);
  std::ofstream(directory.path() / "events.h5") << std::string("\x89HDF\r\n\x1a\n\0\0", 10);
  directory.finish("{ broken");
  const Inspection found = inspect(out_);
  EXPECT_EQ(found.status, RecordingStatus::unknown);
  EXPECT_TRUE(contains(found.cameras.at(0).problem, "not an HDF5 file"));
  EXPECT_TRUE(contains(describe(found), "not an HDF5 file"));
}

TEST_F(InspectTest, NothingToLookAt) {
  EXPECT_TRUE(contains(message_of<UserError>([&] { inspect(out_); }), "no such file or directory"));
  EXPECT_TRUE(contains(message_of<UserError>([&] { inspect(base_.path()); }), "is not a recording"));
  EXPECT_NE(message_of<UserError>([&] { inspect(base_.write("bad.txt", "1 2 3\n")); }), "nothing was thrown");
  EXPECT_NE(message_of<UserError>([&] { inspect(base_.write("bad.h5", "1 2 3\n")); }), "nothing was thrown");
  EXPECT_NE(message_of<UserError>([&] { inspect(""); }), "nothing was thrown");
}

TEST_F(InspectTest, ReportsOfAnyKindAreRead) {
  for (const char* report : {"[]", "3", "null", "{\"status\": 3}", "{\"status\": \"new word\"}", ""}) {
    fs::create_directories(out_);
    write_events(out_ / "events.h5");
    std::ofstream(out_ / "report.json") << report;
    EXPECT_EQ(inspect(out_).status, RecordingStatus::unknown) << report;
  }
}

}  // namespace
}  // namespace esim

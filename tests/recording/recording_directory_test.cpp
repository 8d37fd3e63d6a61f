#include "esim/recording/recording_directory.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::message_of;

class RecordingDirectoryTest : public testing::Test {
 protected:
  std::string refusal(const fs::path& path, bool force) {
    return message_of<UserError>([&] { RecordingDirectory directory(path, force); });
  }
  /// The error of a path that is refused because something exists there.
  Remedy remedy() {
    try {
      RecordingDirectory directory(out_, false);
    } catch (const RemediableError& error) {
      EXPECT_FALSE(contains(error.what(), "--")) << "messages of the library must not name flags";
      return error.remedy();
    }
    return Remedy::none;
  }
  void make_recording(const std::string& marker) {
    RecordingDirectory directory(out_, fs::exists(out_));
    std::ofstream(directory.path() / marker) << marker;
    directory.finish("{\"status\": \"complete\"}\n");
  }
  void leave_killed_run() {
    const pid_t child = fork();
    if (child == 0) {
      RecordingDirectory directory(out_, true);
      std::ofstream(directory.path() / "part") << "part";
      raise(SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
  }

  test::TemporaryDirectory base_;
  fs::path out_ = base_.path() / "out";
  fs::path incomplete_ = base_.path() / "out.incomplete";
};

TEST_F(RecordingDirectoryTest, AppearsCompleteOrNotAtAll) {
  {
    RecordingDirectory directory(out_, false);
    EXPECT_EQ(directory.path(), incomplete_);
    EXPECT_EQ(directory.final_path(), out_);
    EXPECT_EQ(test::content(incomplete_ / "report.json"), "{\"status\": \"running\"}\n");
    EXPECT_FALSE(fs::exists(out_));
    std::ofstream(directory.path() / "file") << "content";
    directory.finish("the report");
    EXPECT_EQ(test::content(out_ / "report.json"), "the report");
    EXPECT_FALSE(fs::exists(incomplete_));
  }
  EXPECT_EQ(test::content(out_ / "file"), "content");
  EXPECT_FALSE(fs::exists(out_ / "report.json.tmp"));
}

TEST_F(RecordingDirectoryTest, AbortLeavesNothing) {
  {
    RecordingDirectory directory(base_.path() / "a" / "b" / "out", false);
    std::ofstream(directory.path() / "file") << "content";
  }
  EXPECT_TRUE(fs::is_empty(base_.path()));
}

TEST_F(RecordingDirectoryTest, AbortKeepsWhatOthersPutIntoNewParents) {
  {
    RecordingDirectory directory(base_.path() / "a" / "out", false);
    std::ofstream(base_.path() / "a" / "theirs") << "content";
  }
  EXPECT_TRUE(fs::exists(base_.path() / "a" / "theirs"));
}

TEST_F(RecordingDirectoryTest, ParentsAreCreatedAndNamesNormalised) {
  {
    RecordingDirectory directory(base_.path() / "x" / "." / "y" / "", false);
    directory.finish("{}");
  }
  EXPECT_TRUE(fs::exists(base_.path() / "x" / "y" / "report.json"));
}

TEST_F(RecordingDirectoryTest, ExistingRecordingNeedsForce) {
  make_recording("old");
  EXPECT_TRUE(contains(refusal(out_, false), "exists already"));
  EXPECT_TRUE(contains(refusal(out_, false), out_.string()));
  EXPECT_EQ(remedy(), Remedy::replace_output);
  EXPECT_TRUE(fs::exists(out_ / "old"));
  make_recording("new");
  EXPECT_TRUE(fs::exists(out_ / "new"));
  EXPECT_FALSE(fs::exists(out_ / "old"));
  EXPECT_FALSE(fs::exists(incomplete_));
}

TEST_F(RecordingDirectoryTest, OldRecordingStaysIfTheNewOneIsAborted) {
  make_recording("old");
  { RecordingDirectory directory(out_, true); }
  EXPECT_TRUE(fs::exists(out_ / "old"));
  EXPECT_FALSE(fs::exists(incomplete_));
}

TEST_F(RecordingDirectoryTest, KilledRunStaysAndNeedsForce) {
  leave_killed_run();
  ASSERT_TRUE(fs::exists(incomplete_ / "part"));
  EXPECT_FALSE(is_being_written(incomplete_));
  EXPECT_TRUE(contains(refusal(out_, false), "killed"));
  EXPECT_EQ(remedy(), Remedy::replace_output);
  EXPECT_TRUE(fs::exists(incomplete_ / "part"));
  {
    RecordingDirectory directory(out_, true);
    EXPECT_FALSE(fs::exists(incomplete_ / "part"));
    directory.finish("{}");
  }
  EXPECT_TRUE(fs::exists(out_ / "report.json"));
}

TEST_F(RecordingDirectoryTest, RunningRunIsNeverReplaced) {
  RecordingDirectory running(out_, false);
  EXPECT_TRUE(is_being_written(incomplete_));
  EXPECT_TRUE(contains(refusal(out_, true), "is being written by another process"));
  EXPECT_TRUE(contains(refusal(out_, false), "is being written by another process"));
  EXPECT_TRUE(fs::exists(incomplete_ / "report.json"));
  running.finish("{}");
}

TEST_F(RecordingDirectoryTest, ForceSparesWhatIsNotARecording) {
  fs::create_directory(out_);
  std::ofstream(out_ / "thesis.tex") << "years of work";
  EXPECT_TRUE(contains(refusal(out_, true), "does not look like a recording"));
  fs::create_directory(base_.path() / "other.incomplete");
  std::ofstream(base_.path() / "other.incomplete" / "thesis.tex") << "years of work";
  EXPECT_TRUE(contains(refusal(base_.path() / "other", true), "does not look like a recording"));
  EXPECT_TRUE(fs::exists(out_ / "thesis.tex"));

  std::ofstream(base_.path() / "file") << "content";
  EXPECT_TRUE(contains(refusal(base_.path() / "file", true), "is a file"));
  EXPECT_TRUE(contains(refusal(base_.path() / "file", false), "is a file"));
  EXPECT_FALSE(contains(refusal(base_.path() / "file" / "below", false), "nothing"));
  for (const char* path : {"/", ".", "..", "", "./", "/.."}) {
    EXPECT_NE(refusal(path, true), "nothing was thrown") << path;
  }
}

TEST_F(RecordingDirectoryTest, ForceSparesHomeAndLinks) {
  make_recording("recording");
  fs::create_directory_symlink(out_, base_.path() / "link");
  EXPECT_TRUE(contains(refusal(base_.path() / "link", true), "symbolic link"));
  const std::string home = std::getenv("HOME") != nullptr ? std::getenv("HOME") : "";
  setenv("HOME", out_.c_str(), 1);
  EXPECT_TRUE(contains(refusal(out_, true), "home directory"));
  setenv("HOME", home.c_str(), 1);
  EXPECT_TRUE(fs::exists(out_ / "recording"));
}

TEST_F(RecordingDirectoryTest, EmptyDirectoryIsReplacedWithForceOnly) {
  fs::create_directory(out_);
  EXPECT_EQ(remedy(), Remedy::replace_output);
  RecordingDirectory directory(out_, true);
  directory.finish("{}");
  EXPECT_TRUE(fs::exists(out_ / "report.json"));
}

TEST_F(RecordingDirectoryTest, WhatAppearedMeanwhileIsSpared) {
  {
    RecordingDirectory directory(out_, false);
    fs::create_directory(out_);
    const auto message = message_of<OutputError>([&] { directory.finish("{}"); });
    EXPECT_TRUE(contains(message, "is kept"));
  }
  EXPECT_TRUE(fs::is_empty(out_));
  EXPECT_TRUE(fs::exists(incomplete_ / "report.json"));
}

TEST_F(RecordingDirectoryTest, UnwritableParentIsNamed) {
  const auto failure = [](const fs::path& path) {
    return message_of<OutputError>([&] { RecordingDirectory directory(path, false); });
  };
  EXPECT_TRUE(contains(failure("/proc/out"), "cannot create the directory /proc/out.incomplete: "));
  EXPECT_TRUE(contains(failure("/proc/a/out"), "cannot create the directory /proc/a: "));
  EXPECT_TRUE(contains(failure("/proc/a/out"), "; choose another folder for the output"));
}

TEST_F(RecordingDirectoryTest, AFullDiskAtTheReportKeepsTheRecording) {
  {
    std::optional<test::FileSizeLimit> full;
    RecordingDirectory directory(out_, false);
    std::ofstream(directory.path() / "file") << "content";
    full.emplace(10);
    EXPECT_THROW(directory.finish(std::string(1000, ' ')), OutputError);
  }
  EXPECT_FALSE(fs::exists(out_));
  EXPECT_EQ(test::content(incomplete_ / "file"), "content");
  EXPECT_EQ(test::content(incomplete_ / "report.json"), "{\"status\": \"running\"}\n");
}

TEST_F(RecordingDirectoryTest, WhatIsToBeKeptStaysAndSaysWhy) {
  { RecordingDirectory(out_, false).keep("the disk is \"full\""); }
  EXPECT_TRUE(contains(test::content(incomplete_ / "report.json"), R"("reason": "the disk is \"full\"")"));
  EXPECT_FALSE(is_being_written(incomplete_));
  { RecordingDirectory(out_, true).finish("{}"); }
  EXPECT_FALSE(fs::exists(incomplete_));
}

TEST_F(RecordingDirectoryTest, WhatAKilledRunLeftAtOnceIsReplaced) {
  fs::create_directory(incomplete_);
  base_.write("out.incomplete/report.json.tmp", "{\"st");
  EXPECT_TRUE(contains(refusal(out_, false), "is left from a run that was killed"));
  { RecordingDirectory(out_, true).finish("{}"); }
  EXPECT_FALSE(fs::exists(incomplete_));
}

}  // namespace
}  // namespace esim

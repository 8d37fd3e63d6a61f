// HDF5 files of a process that is killed before each of its writes, in one run per write.
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

#include "esim/core/error.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/truth.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 64, kHeight = 48;

/// Runs work() in another process, which is killed just before its `number`-th write to a file, counted from 1. Returns
/// false if it ended earlier; nothing if processes cannot be traced.
template <typename Work>
std::optional<bool> killed_at_write(int number, const Work& work) {
  const pid_t child = fork();
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(77);
    raise(SIGSTOP);
    work();
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFSTOPPED(status)) return std::nullopt;
  bool entering = false;
  for (int writes = 0; ptrace(PTRACE_SYSCALL, child, nullptr, nullptr) == 0;) {
    waitpid(child, &status, 0);
    if (!WIFSTOPPED(status)) return false;
    user_regs_struct registers{};
    entering = !entering;
    if (ptrace(PTRACE_GETREGS, child, nullptr, &registers) != 0) return std::nullopt;
    if (!entering || registers.orig_rax != SYS_pwrite64 || ++writes < number) continue;
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    return true;
  }
  return std::nullopt;
}

/// Checks that look() never finds less data after more writes.
template <typename Work, typename Look>
void at_any_write(const Work& work, const Look& look) {
  std::uint64_t max = 0;
  bool readable = false;
  constexpr int kMax = 5000;
  for (int number = 1; number < kMax;
       number += number < 80 ? 1 : 31) {  // later, only some writes of each of the many flushes
    const auto killed = killed_at_write(number, work);
    if (!killed) GTEST_SKIP() << "processes cannot be traced here";
    std::uint64_t found = 0;
    try {
      found = look();
      readable = true;
    } catch (const UserError& error) {
      ASSERT_FALSE(readable) << "write " << number << ": " << error.what();
    }
    ASSERT_GE(found, max) << "write " << number;
    max = found;
    if (!*killed) return;
  }
  FAIL() << "the writer did not end";
}

TEST(KilledWriter, EventsAreReadAsFarAsTheLastFlush) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "supports one processor architecture only";
#endif
  const test::TemporaryDirectory base;
  const fs::path file = base.path() / "events.h5";
  const auto events = test::random_events(250'000, kWidth, kHeight, 0, 4 * kNsPerSecond);
  at_any_write(
      [&] {
        EventsHdf5Writer writer(file, 0, {TimeUnit::ns, Compression::gzip});
        test::record(writer, test::recording_info(kWidth, kHeight, 0, 4 * kNsPerSecond), events);
      },
      [&] {
        const EventsHdf5Reader reader(file);
        const auto found = reader.read(0, events.size());
        EXPECT_TRUE(std::equal(found.begin(), found.end(), events.begin()));
        for (const TimeNs t : {TimeNs{0}, kNsPerSecond, 4 * kNsPerSecond})
          EXPECT_LE(reader.find(t, t + 1).first, found.size());
        return found.size();
      });
}

TEST(KilledWriter, LabelsAreReadWithTheirEvents) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "supports one processor architecture only";
#endif
  const test::TemporaryDirectory base;
  const fs::path file = base.path() / "events.h5";
  const auto events = test::random_events(150'000, kWidth, kHeight, 0, 4 * kNsPerSecond);
  std::vector<EventLabel> labels(events.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    labels[i].t_ideal = events[i].t - static_cast<TimeNs>(i);
    labels[i].signal = static_cast<float>(i), labels[i].hot = i % 2;
  }
  at_any_write(
      [&] {
        EventsHdf5Writer writer(file, 0, {TimeUnit::ns, Compression::gzip});
        RecordingInfo info = test::recording_info(kWidth, kHeight, 0, 4 * kNsPerSecond);
        info.cameras[0].has_labels = true;
        writer.begin(info);
        writer.write(EventsRecord{0, events, labels});
        writer.end(true);
      },
      [&] {
        const EventsHdf5Reader reader(file);
        const auto found = reader.read(0, events.size());
        std::vector<EventLabel> found_labels;
        reader.read_labels(0, found.size(), found_labels);
        EXPECT_TRUE(std::equal(found.begin(), found.end(), events.begin()));
        EXPECT_EQ(found_labels.size(), found.size());
        EXPECT_TRUE(std::equal(found_labels.begin(), found_labels.end(), labels.begin()));
        return found.size();
      });
}

TEST(KilledWriter, GroundTruthIsReadAsFarAsTheLastFlush) {
#if !defined(__x86_64__)
  GTEST_SKIP() << "supports one processor architecture only";
#endif
  const test::TemporaryDirectory base;
  const fs::path file = base.path() / "truth.h5";
  constexpr int kFrames = 70;  // more than one node of an index can hold
  at_any_write(
      [&] {
        TruthHdf5Writer writer(file, 0, {true, true, Compression::gzip, false});
        writer.begin(test::recording_info(kWidth, kHeight, 0, kFrames * kNsPerMs, 1000));
        for (int i = 0; i < kFrames; ++i) {
          const test::TruthImages images(kWidth, kHeight, i);
          writer.write(images.at(i * kNsPerMs));
        }
        writer.end(true);
      },
      [&] {
        const TruthHdf5Reader reader(file);
        TruthHdf5Reader::Frame frame;
        for (std::uint64_t i = 0; i < reader.size(); ++i) {
          EXPECT_EQ(reader.t(i), static_cast<TimeNs>(i) * kNsPerMs);
          reader.read(i, frame);
          EXPECT_EQ(frame.motion_x(3, 5), test::TruthImages(kWidth, kHeight, static_cast<double>(i)).motion_x(3, 5));
        }
        return reader.size();
      });
}

}  // namespace
}  // namespace esim

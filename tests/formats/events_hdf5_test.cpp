#include "esim/formats/hdf5/dsec.h"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;
using test::random_events;
using test::record;
using test::recording_info;
using test::TemporaryDirectory;

struct Case {
  TimeUnit unit;
  Compression compression;
};

class EventsHdf5 : public testing::TestWithParam<Case> {
 protected:
  EventsHdf5Options options() const { return {GetParam().unit, GetParam().compression}; }
  TimeNs unit_ns() const { return GetParam().unit == TimeUnit::us ? kNsPerUs : 1; }
  TimeNs floored(TimeNs t) const { return (t >= 0 ? t / unit_ns() : -((-t + unit_ns() - 1) / unit_ns())) * unit_ns(); }
  std::vector<Event> floored(std::vector<Event> events) const {
    for (Event& event : events) event.t = floored(event.t);
    return events;
  }
  std::filesystem::path write(const RecordingInfo& info, const std::vector<Event>& events, bool complete = true) const {
    const auto path = directory_.path() / "events.h5";
    EventsHdf5Writer writer(path, 0, options());
    record(writer, info, events, complete);
    return path;
  }

  TemporaryDirectory directory_;
};

// Reads through the HDF5 library, not through the reader under test.
std::vector<std::uint64_t> read_raw(const std::filesystem::path& path, const char* name) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t space = H5Dget_space(dataset);
  std::vector<std::uint64_t> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(dataset, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(dataset);
  H5Fclose(file);
  return values;
}

std::size_t raw_type_size(const std::filesystem::path& path, const char* name) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t type = H5Dget_type(dataset);
  const std::size_t size = H5Tget_size(type);
  H5Tclose(type);
  H5Dclose(dataset);
  H5Fclose(file);
  return size;
}

TEST_P(EventsHdf5, RoundTrip) {
  for (const TimeNs start : {TimeNs{0}, TimeNs{1'234'567'891}, TimeNs{-5'000'000'777}}) {
    const TimeNs end = start + 900'000'000;
    const auto events = random_events(150'000, 346, 260, start, end);
    const EventsHdf5Reader reader(write(recording_info(346, 260, start, end), events));
    EXPECT_EQ(reader.size(), events.size());
    EXPECT_EQ(reader.width(), 346);
    EXPECT_EQ(reader.height(), 260);
    EXPECT_EQ(reader.unit(), GetParam().unit);
    EXPECT_EQ(reader.t_offset(), floored(start));
    EXPECT_EQ(reader.complete(), true);
    EXPECT_EQ(reader.read(0, events.size() + 7), floored(events));
    EXPECT_EQ(reader.read(events.size(), 5).size(), 0u);
    EXPECT_EQ(reader.time_span()->start, floored(events.front().t));
    EXPECT_EQ(reader.time_span()->end, floored(events.back().t));
    const auto on = std::count_if(events.begin(), events.end(), [](const Event& e) { return e.polarity > 0; });
    EXPECT_EQ(reader.count_on(), static_cast<std::uint64_t>(on));
  }
}

TEST_P(EventsHdf5, MillisecondIndexIsTheFirstEventNotBefore) {
  for (const TimeNs start : {TimeNs{0}, TimeNs{777}, TimeNs{-1'500'000}}) {
    const TimeNs end = start + 123'456'789;
    const auto events = random_events(20'000, 64, 48, start, end, 3);
    const auto path = write(recording_info(64, 48, start, end), events);
    const auto t = read_raw(path, "events/t");
    const auto index = read_raw(path, "ms_to_idx");
    EXPECT_EQ(index.size(), static_cast<std::size_t>((floored(end) - floored(start) - 1) / kNsPerMs) + 2)
        << "up to the end, rounded up";
    const std::uint64_t units_per_ms = static_cast<std::uint64_t>(kNsPerMs / unit_ns());
    for (std::size_t ms = 0; ms < index.size(); ++ms) {
      const auto expected = std::lower_bound(t.begin(), t.end(), ms * units_per_ms) - t.begin();
      ASSERT_EQ(index[ms], static_cast<std::uint64_t>(expected)) << "ms " << ms;
    }
  }
}

TEST_P(EventsHdf5, WindowsAreThoseOfBruteForce) {
  const TimeNs start = 42, end = start + 50'000'000;
  const auto events = random_events(30'000, 64, 48, start, end, 4);
  const EventsHdf5Reader reader(write(recording_info(64, 48, start, end), events));
  const auto stored = floored(events);
  std::mt19937_64 random(5);
  for (int i = 0; i < 60; ++i) {
    TimeNs t0 = start - 3'000'000 + static_cast<TimeNs>(random() % 60'000'000);
    if (i % 3 == 0) t0 = stored[random() % stored.size()].t;
    const TimeNs t1 = t0 + static_cast<TimeNs>(random() % 5'000'000) - 100;
    std::vector<Event> expected;
    for (const Event& event : stored) {
      if (event.t >= t0 && event.t < t1) expected.push_back(event);
    }
    ASSERT_EQ(reader.read_window(t0, t1), expected) << t0 << " " << t1;
  }
  constexpr TimeNs kMin = std::numeric_limits<TimeNs>::min(), kMax = std::numeric_limits<TimeNs>::max();
  EXPECT_EQ(reader.read_window(kMin, kMax).size(), events.size());
}

TEST_P(EventsHdf5, EmptyRecording) {
  const auto path = write(recording_info(10, 20, 5, 3'000'005), {});
  const EventsHdf5Reader reader(path);
  EXPECT_EQ(reader.size(), 0u);
  EXPECT_FALSE(reader.time_span());
  EXPECT_EQ(reader.count_on(), 0u);
  EXPECT_TRUE(reader.read(0, 10).empty());
  EXPECT_TRUE(reader.read_window(0, 1'000'000).empty());
  EXPECT_EQ(read_raw(path, "ms_to_idx"), (std::vector<std::uint64_t>{0, 0, 0, 0}));
}

TEST_P(EventsHdf5, BytesDoNotDependOnBatches) {
  const auto info = recording_info(64, 48, 0, 2'000'000'000);
  const auto events = random_events(140'000, 64, 48, 0, info.end);
  std::string bytes;
  for (const std::size_t largest : {1'000'000, 1000, 37}) {
    const auto path = directory_.path() / "events.h5";
    EventsHdf5Writer writer(path, 0, options());
    writer.begin(info);
    test::write_in_batches(writer, events, largest);
    writer.write(PoseRecord{5, {}});
    writer.end(true);
    if (bytes.empty()) bytes = test::content(path);
    EXPECT_TRUE(test::content(path) == bytes) << "batches of up to " << largest;
  }
}

TEST_P(EventsHdf5, InterruptedRecordingEndsWhereItEnds) {
  const auto info = recording_info(64, 48, 0, kNsPerSecond);
  const auto path = directory_.path() / "events.h5";
  EventsHdf5Writer writer(path, 0, options());
  writer.begin(info);
  const Event event{1'500'000, 3, 4, 1};
  writer.write(EventsRecord{0, {&event, 1}});
  writer.write(PoseRecord{4'200'000, {}});
  writer.end(false);
  EXPECT_EQ(EventsHdf5Reader(path).complete(), false);
  EXPECT_EQ(read_raw(path, "ms_to_idx"), (std::vector<std::uint64_t>{0, 0, 1, 1, 1, 1}));
}

// DSEC's reader selects the events of [a, b) from those between the milliseconds floor(a) and ceil(b) since t_offset,
// both of which must have an entry. Windows may reach to just after the last event and to the end of the recording.
TEST_P(EventsHdf5, EveryWindowHasItsMilliseconds) {
  for (const TimeNs last : {999'310'000, 999'999'999, 1'000'000'000, 1'000'000'001, 1'500'200'000}) {
    for (const TimeNs end : {TimeNs{0}, kNsPerSecond, kNsPerSecond + 300'000}) {
      const std::vector<Event> events{{310'000, 1, 2, 1}, {500'000'000, 3, 4, -1}, {last, 5, 6, 1}};
      const auto path = write(recording_info(64, 48, 0, end), events);
      const auto t = read_raw(path, "events/t");
      const auto index = read_raw(path, "ms_to_idx");
      const std::uint64_t units_per_ms = static_cast<std::uint64_t>(kNsPerMs / unit_ns());
      const std::uint64_t b = std::max(t.back() + 1, static_cast<std::uint64_t>(end / unit_ns()));
      ASSERT_LT((b + units_per_ms - 1) / units_per_ms, index.size()) << last << " " << end;
      for (std::size_t ms = 0; ms < index.size(); ++ms) {
        const auto expected = std::lower_bound(t.begin(), t.end(), ms * units_per_ms) - t.begin();
        ASSERT_EQ(index[ms], static_cast<std::uint64_t>(expected)) << "ms " << ms;
      }
    }
  }
}

std::string name_of(const testing::TestParamInfo<Case>& instance) {
  const char* compressions[] = {"blosc", "gzip", "none"};
  return std::string(instance.param.unit == TimeUnit::us ? "us_" : "ns_") +
         compressions[static_cast<int>(instance.param.compression)];
}

INSTANTIATE_TEST_SUITE_P(Options, EventsHdf5,
                         testing::Values(Case{TimeUnit::us, Compression::blosc}, Case{TimeUnit::ns, Compression::blosc},
                                         Case{TimeUnit::us, Compression::gzip}, Case{TimeUnit::ns, Compression::none}),
                         name_of);

TEST(EventsHdf5Writer, TimesAreWideOnlyWhereTheyMustBe) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "events.h5";
  constexpr TimeNs kLimit = TimeNs{std::numeric_limits<std::uint32_t>::max()} * kNsPerUs;
  const auto bytes_of_t = [&](TimeNs end) {
    EventsHdf5Writer writer(path, 0);
    writer.begin(recording_info(10, 10, 0, end));
    const Event event{end, 1, 2, -1};
    writer.write(EventsRecord{0, {&event, 1}});
    writer.end(false);
    EXPECT_EQ(EventsHdf5Reader(path).read(0, 1).at(0), event);
    return raw_type_size(path, "events/t");
  };
  EXPECT_EQ(bytes_of_t(kLimit), 4u);
  EXPECT_EQ(bytes_of_t(kLimit + kNsPerUs), 8u);
}

TEST(EventsHdf5Writer, OtherCamerasEventsAreLeftAlone) {
  const TemporaryDirectory directory;
  auto info = recording_info(10, 10, 0, kNsPerSecond);
  info.cameras.push_back(info.cameras[0]);
  info.cameras[1].name = "cam1";
  info.cameras[1].model.width = 30;
  EventsHdf5Writer writer(directory.path() / "events.h5", 1);
  writer.begin(info);
  const Event first{10, 1, 2, 1}, second{5, 25, 2, 1};
  writer.write(EventsRecord{0, {&first, 1}});
  writer.write(EventsRecord{1, {&second, 1}});
  writer.end(true);
  EXPECT_EQ(EventsHdf5Reader(directory.path() / "events.h5").size(), 1u);
  EXPECT_EQ(EventsHdf5Reader(directory.path() / "events.h5").width(), 30);
}

TEST(EventsHdf5Writer, BrokenContractsAreInternalErrors) {
  const TemporaryDirectory directory;
  EventsHdf5Writer writer(directory.path() / "events.h5", 0);
  writer.begin(recording_info(10, 10, 1000, kNsPerSecond));
  const auto write = [&](Event event) { writer.write(EventsRecord{0, {&event, 1}}); };
  write({2000, 5, 5, 1});
  EXPECT_THROW(write({1999, 5, 5, 1}), InternalError);
  EXPECT_THROW(write({3000, 10, 5, 1}), InternalError);
  EXPECT_THROW(write({3000, 5, 10, 1}), InternalError);
}

TEST(EventsHdf5Writer, KilledProcessLeavesWhatItFlushed) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "events.h5";
  const auto events = random_events(300'000, 64, 48, 0, kNsPerSecond);
  const pid_t child = fork();
  if (child == 0) {
    EventsHdf5Writer writer(path, 0);
    writer.begin(recording_info(64, 48, 0, kNsPerSecond));
    test::write_in_batches(writer, events, 5000);
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));

  const EventsHdf5Reader reader(path);
  EXPECT_EQ(reader.complete(), false);
  ASSERT_GE(reader.size(), events.size() - 65536);
  const auto read = reader.read(0, reader.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    ASSERT_EQ(read[i].t, events[i].t / kNsPerUs * kNsPerUs);
    ASSERT_EQ(read[i].x, events[i].x);
  }
  const TimeNs middle = read[read.size() / 2].t;
  EXPECT_EQ(
      reader.find(middle, middle + 1).first,
      static_cast<std::uint64_t>(std::lower_bound(read.begin(), read.end(), Event{middle, 0, 0, -1}) - read.begin()));
}

TEST(EventsHdf5Writer, KilledAtOnceLeavesAnEmptyFile) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "events.h5";
  const pid_t child = fork();
  if (child == 0) {
    EventsHdf5Writer writer(path, 0);
    writer.begin(recording_info(64, 48, 0, kNsPerSecond));
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  const EventsHdf5Reader reader(path);
  EXPECT_EQ(reader.size(), 0u);
  EXPECT_EQ(reader.complete(), false);
}

// At every stage of the life of the file, from its creation to its last flush.
TEST(EventsHdf5Writer, FullDiskIsAnOutputErrorAndNothingElse) {
  const TemporaryDirectory directory;
  const auto events = random_events(200'000, 64, 48, 0, 30 * kNsPerSecond);
  const auto whole = directory.path() / "whole.h5";
  EventsHdf5Writer writer(whole, 0);
  record(writer, recording_info(64, 48, 0, 30 * kNsPerSecond), events);
  const auto size = std::filesystem::file_size(whole);

  testing::internal::CaptureStderr();
  for (std::uintmax_t limit = 0; limit < size; limit += std::max<std::uintmax_t>(limit < 8192 ? 256 : size / 40, 1)) {
    const auto path = directory.path() / "events.h5";
    const std::string message = message_of<OutputError>([&] {
      const test::FileSizeLimit full(limit);
      EventsHdf5Writer limited(path, 0);
      record(limited, recording_info(64, 48, 0, 30 * kNsPerSecond), events);
    });
    ASSERT_TRUE(contains(message, path.string())) << "limit " << limit;
    ASSERT_TRUE(contains(message, "File too large")) << "limit " << limit;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");

  // The library still works.
  EXPECT_EQ(EventsHdf5Reader(whole).read(0, 1'000'000).size(), events.size());
}

TEST(EventsHdf5Writer, GoingOnAfterAFailureFailsAgain) {
  const TemporaryDirectory directory;
  const auto events = random_events(200'000, 64, 48, 0, kNsPerSecond);
  testing::internal::CaptureStderr();
  {
    EventsHdf5Writer writer(directory.path() / "events.h5", 0, {TimeUnit::us, Compression::none});
    writer.begin(recording_info(64, 48, 0, kNsPerSecond));
    {
      const test::FileSizeLimit full(300'000);
      EXPECT_THROW(writer.write(EventsRecord{0, events}), OutputError);
    }
    EXPECT_THROW(writer.end(false), OutputError);
    EXPECT_THROW(writer.end(true), OutputError);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(EventsHdf5Writer, UnwritablePlacesAreNamed) {
  const auto begin = [](const std::filesystem::path& path) {
    return message_of<OutputError>([&] {
      EventsHdf5Writer writer(path, 0);
      writer.begin(recording_info(10, 10, 0, 10));
    });
  };
  EXPECT_EQ(begin("/nonexistent/events.h5"), "cannot write /nonexistent/events.h5: No such file or directory");
  EXPECT_TRUE(contains(begin("/dev/full"), "cannot write /dev/full: "));
  EXPECT_EQ(begin("/"), "cannot write /: Is a directory");
}

TEST(EventsHdf5WriterDeathTest, BloscNeedsNoPlugin) {
  testing::FLAGS_gtest_death_test_style =
      "threadsafe";  // a new process, in which HDF5 has not searched for plugins yet
  EXPECT_EXIT(
      {
        setenv("HDF5_PLUGIN_PATH", "/nonexistent", 1);
        const test::TemporaryDirectory folder;
        const std::vector<Event> events(100'000, Event{5, 1, 2, 1});
        const auto path = folder.path() / "events.h5";
        EventsHdf5Writer writer(path, 0, {TimeUnit::us, Compression::blosc});
        test::record(writer, recording_info(10, 10, 0, 10), events);
        std::exit(std::filesystem::file_size(path) < 100'000 ? 0 : 1);  // 1.3 MB without compression
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace esim

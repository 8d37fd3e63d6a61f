// Requirements for every format of events. The tests cover every format in the list of all_formats().
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "formats/event_formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

class EveryFormat : public testing::TestWithParam<std::string> {
 protected:
  EveryFormat() {
    info_ =
        test::recording_info(std::min(format_.max_width, 640), std::min(format_.max_height, 480), 0, 3 * kNsPerSecond);
  }

  /// Random events on the sensor, at times that the format can hold.
  std::vector<Event> random_events(std::size_t count) const {
    const Camera& camera = info_.cameras[0].model;
    std::vector<Event> events = test::random_events(count, camera.width, camera.height, info_.start, info_.end);
    for (Event& event : events) event.t -= event.t % format_.resolution;
    return events;
  }

  fs::path write(const std::vector<Event>& events) const {
    const fs::path path = base_.path() / ("events" + format_.extension());
    test::record(*format_.create(path, WriteOptions{TimeUnit::ns, Compression::blosc}), info_, events);
    return path;
  }

  /// The file with the events: the path itself, or the largest file in a folder.
  fs::path file_of(const fs::path& path) const {
    if (!format_.folder) return path;
    fs::path largest;
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.is_regular_file() && (largest.empty() || entry.file_size() > fs::file_size(largest)))
        largest = entry.path();
    }
    return largest;
  }

  /// All events of a file up to its damage, and the error, if any.
  static std::vector<Event> read(const fs::path& path, std::string* problem = nullptr) {
    ReadOptions options;
    if (problem != nullptr) options.recover = [problem](const std::string& what) { *problem = what; };
    const auto source = open_source(path, options);
    std::vector<Event> all;
    while (const Record* record = source->next()) {
      if (const auto* events = std::get_if<EventsRecord>(record)) {
        EXPECT_LE(events->events.size(), 1U << 18) << "portions are of moderate size";
        all.insert(all.end(), events->events.begin(), events->events.end());
      }
    }
    return all;
  }

  /// Reads a damaged file with and without recovery: the damage is a UserError that names the file, or goes unnoticed.
  static void expect_no_harm(const fs::path& path, const std::vector<Event>& events, bool is_prefix) {
    try {
      read(path);
    } catch (const UserError& error) {
      EXPECT_TRUE(test::contains(error.what(), path.filename().string())) << error.what();
    }
    std::string problem;
    try {
      const std::vector<Event> found = read(path, &problem);
      if (!is_prefix) return;
      ASSERT_LE(found.size(), events.size());
      EXPECT_TRUE(std::equal(found.begin(), found.end(), events.begin())) << found.size() << " events";
    } catch (const UserError& error) {
      EXPECT_TRUE(test::contains(error.what(), path.filename().string())) << error.what();
    }
  }

  test::TemporaryDirectory base_;
  const Format& format_ = format_named(GetParam());
  RecordingInfo info_;
};

TEST_P(EveryFormat, EventsReadBackAsTheyWere) {
  for (const std::size_t count : {0, 1, 1000, 300'000}) {
    const std::vector<Event> events = random_events(count);
    const fs::path path = write(events);
    const Format& found = format_of(path);
    ASSERT_TRUE(found.name == format_.name || !format_.recognises) << "recognised by its content: " << found.name;
    EXPECT_EQ(read(path), events) << count;
    const auto source = open_source(path);
    EXPECT_LE(source->info().start, events.empty() ? 0 : events.front().t);
    EXPECT_LE(source->progress(), 1);
  }
}

TEST_P(EveryFormat, CornersOfTheSensorAndTheLargestOne) {
  const int width = std::min(format_.max_width, 65536), height = std::min(format_.max_height, 65536);
  info_ = test::recording_info(width, height, 0, kNsPerSecond);
  std::vector<Event> events;
  for (const auto& [x, y] : {std::pair{0, 0}, {width - 1, 0}, {0, height - 1}, {width - 1, height - 1}}) {
    for (const std::int8_t polarity : {std::int8_t{-1}, std::int8_t{1}}) {
      events.push_back({static_cast<TimeNs>(events.size() + 1) * format_.resolution, static_cast<std::uint16_t>(x),
                        static_cast<std::uint16_t>(y), polarity});
    }
  }
  EXPECT_EQ(read(write(events)), events);
}

TEST_P(EveryFormat, LargerSensorsAreRefused) {
  if (format_.max_width >= 65536) GTEST_SKIP() << "no larger sensor exists";
  info_ = test::recording_info(format_.max_width + 1, format_.max_height, 0, kNsPerSecond);
  const std::string message = test::message_of<UserError>([&] { write({}); });
  EXPECT_TRUE(test::contains(message, std::to_string(format_.max_width + 1))) << message;
}

TEST_P(EveryFormat, PausesOfSecondsAndMinutes) {
  std::vector<Event> events;
  for (const TimeNs t : {1, 2, 20, 90, 600}) {
    if (t * kNsPerSecond <= format_.max_time) events.push_back({t * kNsPerSecond, 3, 4, 1});
  }
  info_.end = 600 * kNsPerSecond;
  EXPECT_EQ(read(write(events)), events);
}

TEST_P(EveryFormat, CutAnywhereItGivesWhatComesBefore) {
  const std::vector<Event> events = random_events(300);
  const fs::path path = write(events), file = file_of(path);
  const std::string bytes = test::content(file);
  const std::size_t step = std::max<std::size_t>(1, bytes.size() / 300);
  for (std::size_t size = 0; size < bytes.size(); size += step) {
    std::ofstream(file, std::ios::binary) << bytes.substr(0, size);
    expect_no_harm(path, events, true);
  }
}

TEST_P(EveryFormat, DamagedAnywhereItDoesNoHarm) {
  const std::vector<Event> events = random_events(300);
  const fs::path path = write(events), file = file_of(path);
  const std::string bytes = test::content(file);
  std::mt19937_64 random(7);
  for (int i = 0; i < 100; ++i) {
    std::string damaged = bytes;
    for (std::uint64_t k = random() % 4 + 1; k > 0; --k) damaged[random() % bytes.size()] = static_cast<char>(random());
    std::ofstream(file, std::ios::binary) << damaged;
    expect_no_harm(path, events, false);
    EXPECT_EQ(H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL), 0) << "HDF5 objects were left open";
  }
}

TEST_P(EveryFormat, AFullDiskIsNamed) {
  const fs::path path = base_.path() / "full";
  const std::vector<Event> events = random_events(200'000);
  const test::FileSizeLimit limit(4096);
  const auto sink = format_.create(path, {});
  EXPECT_THROW(test::record(*sink, info_, events), OutputError);
}

INSTANTIATE_TEST_SUITE_P(Formats, EveryFormat, testing::ValuesIn(test::event_formats(true)), test::name_of_test);

}  // namespace
}  // namespace esim

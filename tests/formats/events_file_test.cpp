#include "esim/formats/events_file.h"

#include <gtest/gtest.h>
#include <hdf5.h>

#include "esim/core/error.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/text/events_text.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using test::contains;
using test::message_of;

std::vector<Event> read_all(const fs::path& path, std::size_t portion = 1000,
                            std::optional<SensorSize> sensor = std::nullopt) {
  EventsFile file(path, ReadOptions{sensor});
  std::vector<Event> all, events;
  while (file.read(events, portion)) {
    EXPECT_LE(events.size(), portion);
    all.insert(all.end(), events.begin(), events.end());
  }
  return all;
}

class EventsFileTest : public testing::Test {
 protected:
  void write_hdf5(const fs::path& path, const std::vector<Event>& events, EventsHdf5Options options = {}) {
    EventsHdf5Writer writer(path, 0, options);
    test::record(writer, info_, events);
  }
  std::string error_of(const fs::path& path) {
    return message_of<UserError>([&] { read_all(path); });
  }

  test::TemporaryDirectory base_;
  RecordingInfo info_ = test::recording_info(64, 48, 0, 2 * kNsPerSecond);
  std::vector<Event> events_ = test::random_events(10'000, 64, 48, 0, 2 * kNsPerSecond);
};

TEST_F(EventsFileTest, ContentDecidesNotTheName) {
  write_hdf5(base_.path() / "a.txt", events_, {TimeUnit::ns, Compression::gzip});
  EventsTextWriter writer(base_.path() / "a.h5", 0);
  test::record(writer, info_, events_);
  for (const std::size_t portion : {std::size_t{77}, std::size_t{1} << 20}) {
    EXPECT_EQ(read_all(base_.path() / "a.h5", portion), events_);
    EXPECT_EQ(read_all(base_.path() / "a.txt", portion), events_);
  }
  EXPECT_EQ(EventsFile(base_.path() / "a.txt").sensor()->width, 64);
  EXPECT_FALSE(EventsFile(base_.path() / "a.h5").sensor());
}

TEST_F(EventsFileTest, PolaritiesOfBothKinds) {
  const auto path = base_.write("p.txt", "0.1 1 2 1\n0.2 1 2 0\n0.3 1 2 -1\n");
  const auto events = read_all(path);
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[0].polarity, 1);
  EXPECT_EQ(events[1].polarity, -1);
  EXPECT_EQ(events[2].polarity, -1);
}

TEST_F(EventsFileTest, FoldersAndTheirCameras) {
  const fs::path out = base_.path() / "out";
  EXPECT_TRUE(contains(error_of(out), "no such file"));
  fs::create_directories(out / "left");
  EXPECT_TRUE(contains(error_of(out), "no events.h5"));
  write_hdf5(out / "left" / "events.h5", events_, {TimeUnit::ns});
  EXPECT_EQ(read_all(out), events_);
  EXPECT_EQ(EventsFile(out).path(), out / "left" / "events.h5");
  fs::create_directories(out / "right");
  base_.write("out/right/events.txt", "0.1 1 2 1\n");
  EXPECT_TRUE(contains(error_of(out), "several cameras (left, right)"));
  EXPECT_TRUE(contains(error_of(out), (out / "left").string()));
  EXPECT_EQ(read_all(out / "right").size(), 1u);

  // A text file does not state the sensor size, but its recording does.
  EXPECT_FALSE(EventsFile(out / "right").sensor());
  base_.write("out/report.json", R"({"cameras": [{"name": "left", "width": 9, "height": 9},
                                                 {"name": "right", "width": 30, "height": 20}]})");
  EXPECT_EQ(EventsFile(out / "right").sensor()->width, 30);
  for (const char* report : {"[]", "{", "{\"cameras\": 3}", "{\"cameras\": [{\"width\": \"x\"}]}",
                             "{\"cameras\": [{\"width\": -1, \"height\": 1e9}]}", "{\"cameras\": [{}, 3]}"}) {
    base_.write("out/report.json", report);
    EXPECT_FALSE(EventsFile(out / "right").sensor()) << report;
  }
}

TEST_F(EventsFileTest, EventsOutsideTheSensor) {
  const auto path = base_.write("x.txt", "0.1 1 2 1\n0.2 5 2 1\n0.3 9 2 1\n");
  EXPECT_EQ(read_all(path, 2, SensorSize{10, 3}).size(), 3u);
  EXPECT_TRUE(contains(message_of<UserError>([&] {
                         read_all(path, 2, SensorSize{9, 3});
                       }),
                       "event 2 at (9, 2) is outside the sensor of 9 x 3 px"));
}

TEST_F(EventsFileTest, EventsOutOfOrder) {
  EXPECT_TRUE(contains(error_of(base_.write("t.txt", "0.1 1 2 1\n0.3 5 2 1\n0.2 9 2 1\n")),
                       "line 3: the time is before that of the line above, 0.300000000 s"));

  // DSEC's layout, as another program might write it.
  const fs::path path = base_.path() / "unsorted.h5";
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t group = H5Gcreate2(file, "events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  std::vector<int> t(5000), zeros(5000);
  for (int i = 0; i < 5000; ++i) t[static_cast<std::size_t>(i)] = 10 * i;
  t[3000] = 7;
  const hsize_t size = 5000;
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  for (const char* name : {"t", "x", "y", "p"}) {
    const hid_t set = H5Dcreate2(group, name, H5T_STD_U32LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_INT, H5S_ALL, H5S_ALL, H5P_DEFAULT, (*name == 't' ? t : zeros).data());
    H5Dclose(set);
  }
  H5Sclose(space);
  H5Gclose(group);
  H5Fclose(file);
  EXPECT_TRUE(contains(error_of(path), "event 3000 at 0.000007000 s is before event 2999 at 0.029990000 s"));
}

TEST_F(EventsFileTest, FilesOfOtherKindsAndDamagedOnes) {
  EXPECT_TRUE(
      contains(error_of(base_.write("a.png", std::string("\x89PNG\r\n\x1a\n\0\0", 10))), "not in any of the formats"));
  EXPECT_TRUE(contains(error_of(base_.write("junk.txt", "0.1 1 2 1\n0.2 1 2 1\n0.3 one 2 1\n")), "line 3: \"one\""));
  EXPECT_TRUE(contains(error_of(base_.write("far.txt", "9000000000 1 2 1\n")), "the time must be within"));
  write_hdf5(base_.path() / "whole.h5", events_);
  const std::string bytes = test::content(base_.path() / "whole.h5");
  EXPECT_TRUE(contains(error_of(base_.write("cut.h5", bytes.substr(0, bytes.size() / 2))), "cut.h5"));
  EXPECT_TRUE(read_all(base_.write("empty.txt", "")).empty());
}

}  // namespace
}  // namespace esim

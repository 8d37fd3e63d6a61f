// HDF5 layouts of other programs. every_format_test.cpp covers the formats that can be written; these tests read files
// as other programs write them.
#include <gtest/gtest.h>
#include <hdf5.h>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "formats/recorded.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

/// An HDF5 file written with the library directly.
class File {
 public:
  explicit File(const fs::path& path) : id_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
  ~File() { H5Fclose(id_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void add_group(const char* name) const { H5Gclose(H5Gcreate2(id_, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)); }

  template <typename T>
  void add(const char* name, hid_t type, const std::vector<T>& numbers) const {
    add(name, type, std::vector<hsize_t>{numbers.size()}, numbers);
  }

  template <typename T>
  void add(const char* name, hid_t type, const std::vector<hsize_t>& shape, const std::vector<T>& numbers) const {
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t dataset = H5Dcreate2(id_, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    H5Dclose(dataset);
    H5Sclose(space);
  }

 private:
  hid_t id_;
};

const std::vector<Event> kEvents = {{1'000, 3, 4, 1}, {2'000, 639, 479, -1}, {2'000'000'000, 0, 0, 1}};

class Hdf5Layouts : public testing::Test {
 protected:
  std::string problem() const {
    return test::message_of<UserError>([&] { test::read_all(path_); });
  }

  test::TemporaryDirectory base_;
  fs::path path_ = base_.path() / "events.h5";
};

TEST_F(Hdf5Layouts, E2vidWithSecondsAsFloatingPointNumbers) {
  {
    const File file(path_);
    file.add_group("events");
    file.add<double>("events/ts", H5T_NATIVE_DOUBLE, {1e-6, 2e-6, 2.0});
    file.add<std::int16_t>("events/xs", H5T_NATIVE_INT16, {3, 639, 0});
    file.add<std::int16_t>("events/ys", H5T_NATIVE_INT16, {4, 479, 0});
    file.add<std::int8_t>("events/ps", H5T_NATIVE_INT8, {1, 0, 1});
  }
  EXPECT_EQ(format_of(path_).name, "e2vid");
  EXPECT_EQ(test::read_all(path_).events.at(0), kEvents);
}

TEST_F(Hdf5Layouts, E2calibWithSignedPolarities) {
  {
    const File file(path_);
    file.add<std::int64_t>("t", H5T_NATIVE_INT64, {1, 2, 2'000'000});
    file.add<std::uint16_t>("x", H5T_NATIVE_UINT16, {3, 639, 0});
    file.add<std::uint16_t>("y", H5T_NATIVE_UINT16, {4, 479, 0});
    file.add<std::int8_t>("p", H5T_NATIVE_INT8, {1, -1, 1});
  }
  EXPECT_EQ(format_of(path_).name, "e2calib");
  EXPECT_EQ(test::read_all(path_).events.at(0), kEvents);
}

TEST_F(Hdf5Layouts, V2eWithRowsOfFour) {
  {
    const File file(path_);
    file.add<std::uint32_t>("events", H5T_NATIVE_UINT32, {3, 4}, {1, 3, 4, 1, 2, 639, 479, 0, 2'000'000, 0, 0, 1});
  }
  EXPECT_EQ(format_of(path_).name, "v2e");
  EXPECT_EQ(test::read_all(path_).events.at(0), kEvents);
}

TEST_F(Hdf5Layouts, M3edTellsTheSensorAndFirstEventsOfMilliseconds) {
  RecordingInfo info = test::recording_info(640, 480, 0, 2 * kNsPerSecond);
  info.cameras[0].model.fx = info.cameras[0].model.fy = 500;
  test::record(*format_named("m3ed").create(path_, {.compression = Compression::gzip}), info, kEvents);
  EXPECT_EQ(format_of(path_).name, "m3ed");
  const test::Recorded found = test::read_all(path_);
  EXPECT_EQ(found.events.at(0), kEvents);
  EXPECT_EQ(found.info.cameras[0].model.width, 640);
  EXPECT_EQ(found.info.cameras[0].model.height, 480);

  const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(file, "prophesee/left/ms_map_idx", H5P_DEFAULT);
  const hid_t space = H5Dget_space(dataset);
  std::vector<std::uint64_t> index(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  H5Sclose(space);
  ASSERT_EQ(index.size(), 2002U) << "one entry after the last event, for readers of its millisecond";
  ASSERT_EQ(H5Dread(dataset, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, index.data()), 0);
  H5Dclose(dataset);
  H5Fclose(file);
  EXPECT_EQ(index[0], 0U);  // 1 us is after 0 ms
  for (std::size_t ms = 1; ms <= 2000; ++ms) ASSERT_EQ(index[ms], 2U) << ms;
  EXPECT_EQ(index[2001], kEvents.size());
}

TEST_F(Hdf5Layouts, TimesThatDoNotFitAreRefused) {
  const RecordingInfo info = test::recording_info(640, 480, 0, kNsPerSecond);
  for (const char* name : {"m3ed", "v2e"}) {
    for (const TimeNs t : {-kNsPerSecond, 10'000'000 * kNsPerSecond}) {
      const auto sink = format_named(name).create(path_, {.compression = Compression::gzip});
      const std::vector<Event> events = {{t, 0, 0, 1}};
      sink->begin(info);
      const std::string message = test::message_of<UserError>([&] { sink->write(EventsRecord{0, events}); });
      EXPECT_TRUE(test::contains(message, "does not fit")) << name;
    }
  }
}

TEST_F(Hdf5Layouts, WrongNumbersAreNamed) {
  {
    const File file(path_);
    file.add<double>("t", H5T_NATIVE_DOUBLE, {0, std::numeric_limits<double>::quiet_NaN()});
    for (const char* name : {"x", "y", "p"}) file.add<std::int64_t>(name, H5T_NATIVE_INT64, {0, 0});
  }
  EXPECT_TRUE(test::contains(problem(), "the time of event 1 is out of range"));
  {
    const File file(path_);
    for (const char* name : {"t", "y", "p"}) file.add<std::int64_t>(name, H5T_NATIVE_INT64, {0, 0});
    file.add<std::int64_t>("x", H5T_NATIVE_INT64, {0, 65536});
  }
  EXPECT_TRUE(test::contains(problem(), "event 1 at (65536, 0)"));
  {
    const File file(path_);
    for (const char* name : {"t", "y", "p"}) file.add<std::int64_t>(name, H5T_NATIVE_INT64, {0, 0});
    file.add<std::int64_t>("x", H5T_NATIVE_INT64, {0});
  }
  EXPECT_TRUE(test::contains(problem(), "differ in length"));
  {
    const File file(path_);
    file.add<std::int64_t>("events", H5T_NATIVE_INT64, {1, 4}, {-1, 0, 0, 0});
  }
  EXPECT_TRUE(test::contains(problem(), "event 0 at -1 us"));
}

}  // namespace
}  // namespace esim

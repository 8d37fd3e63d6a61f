#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

#include "esim/core/error.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/truth.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;
using test::TemporaryDirectory;

void read_everything(const std::filesystem::path& path) {
  const EventsHdf5Reader reader(path);
  reader.time_span();
  reader.count_on();
  for (std::uint64_t i = 0; i < reader.size(); i += 10'000) reader.read(i, 10'000);
  reader.read_window(reader.t_offset() + 3'000'000, reader.t_offset() + 9'000'000);
}

void read_truth(const std::filesystem::path& path) {
  const TruthHdf5Reader reader(path);
  TruthHdf5Reader::Frame frame;
  TruthHdf5Reader::OpticalFlow optical_flow;
  for (std::uint64_t i = 0; i < reader.size(); ++i) {
    reader.t(i);
    reader.read(i, frame);
  }
  for (std::uint64_t i = 0; i < reader.optical_flows(); ++i) reader.read(i, optical_flow);
}

// Reading must succeed or fail with a UserError that names the file.
void expect_no_worse_than_user_error(const std::filesystem::path& path, const std::string& what,
                                     void (*read)(const std::filesystem::path&) = read_everything) {
  try {
    read(path);
  } catch (const UserError& error) {
    EXPECT_TRUE(contains(error.what(), path.string())) << what;
  }
}

std::string valid_file(const TemporaryDirectory& directory, Compression compression) {
  const auto path = directory.path() / "valid.h5";
  EventsHdf5Writer writer(path, 0, {TimeUnit::us, compression});
  test::record(writer, test::recording_info(64, 48, 0, 20'000'000), test::random_events(3'000, 64, 48, 0, 20'000'000));
  return test::content(path);
}

std::string valid_truth(const TemporaryDirectory& directory, Compression compression) {
  const auto path = directory.path() / "valid.h5";
  TruthHdf5Writer writer(path, 0, {true, true, compression, true, true});
  RecordingInfo info = test::recording_info(9, 7, 0, kNsPerSecond);
  info.objects = {"a car"};
  writer.begin(info);
  const test::TruthImages images(9, 7, 0);
  const Image<std::uint16_t> object(9, 7);
  const Image<std::uint8_t> visible(9, 7);
  const SE3 pose;
  for (TimeNs t = 0; t < 3; ++t) {
    writer.write(TruthRecord{0, t, pose, images.irradiance, images.depth, images.motion_x, images.motion_y, &object,
                             std::span(&pose, 1)});
    if (t > 0) writer.write(OpticalFlowRecord{0, t - 1, t, images.motion_x, images.motion_y, visible});
  }
  writer.end(true);
  return test::content(path);
}

TEST(HostileHdf5, CutFiles) {
  const TemporaryDirectory directory;
  const std::string bytes = valid_file(directory, Compression::blosc);
  for (std::size_t length = 0; length < bytes.size(); length += std::max<std::size_t>(1, bytes.size() / 150)) {
    const auto path = directory.write("cut.h5", bytes.substr(0, length));
    EXPECT_NE(message_of<UserError>([&] { read_everything(path); }), "nothing was thrown") << length;
  }
  const std::string truth = valid_truth(directory, Compression::blosc);
  for (std::size_t length = 0; length < truth.size(); length += std::max<std::size_t>(1, truth.size() / 150)) {
    const auto path = directory.write("cut.h5", truth.substr(0, length));
    EXPECT_NE(message_of<UserError>([&] { read_truth(path); }), "nothing was thrown") << length;
  }
}

// Runs in a separate process, which ends without the clean-up of the library, since that complains after damaged files.
TEST(HostileHdf5, FlippedBytes) {
  const TemporaryDirectory directory;
  const pid_t child = fork();
  if (child == 0) {
    std::mt19937 random(1);
    for (const auto compression : {Compression::blosc, Compression::gzip}) {
      const std::string bytes = valid_file(directory, compression);
      for (int i = 0; i < 200; ++i) {
        std::string damaged = bytes;
        const std::size_t at = random() % damaged.size();
        damaged[at] = static_cast<char>(random());
        expect_no_worse_than_user_error(directory.write("flipped.h5", damaged), "byte " + std::to_string(at));
      }
      const std::string truth = valid_truth(directory, compression);
      for (int i = 0; i < 150; ++i) {
        std::string damaged = truth;
        const std::size_t at = random() % damaged.size();
        damaged[at] = static_cast<char>(random());
        expect_no_worse_than_user_error(directory.write("flipped.h5", damaged), "byte " + std::to_string(at),
                                        read_truth);
      }
    }
    std::fflush(stdout);
    _exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(HostileHdf5, OtherFiles) {
  const TemporaryDirectory directory;
  for (const char* text : {"", "hello", "\x89HDF\r\n\x1a\n", "\x89HDF\r\n\x1a\n garbage that goes on for a while"}) {
    expect_no_worse_than_user_error(directory.write("other.h5", text), text);
  }
  EXPECT_TRUE(contains(message_of<UserError>([] { EventsHdf5Reader("/nonexistent.h5"); }), "/nonexistent.h5"));
  EXPECT_TRUE(contains(message_of<UserError>([] { EventsHdf5Reader("/tmp"); }), "/tmp"));
}

// Builds files with the HDF5 library, as other programs would.
class Builder {
 public:
  explicit Builder(const std::filesystem::path& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    H5Gclose(H5Gcreate2(file_, "events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  ~Builder() { H5Fclose(file_); }
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  template <typename T>
  void column(const char* name, hid_t file_type, hid_t memory_type, std::vector<T> values,
              bool two_dimensions = false) {
    const hsize_t shape[] = {values.size(), 1};
    const hid_t space = H5Screate_simple(two_dimensions ? 2 : 1, shape, nullptr);
    const hid_t dataset = H5Dcreate2(file_, name, file_type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(dataset);
    H5Sclose(space);
  }
  void integers(const char* name, hid_t type, std::vector<std::int64_t> values) {
    column(name, type, H5T_NATIVE_INT64, std::move(values));
  }
  void dsec_columns() {
    integers("events/t", H5T_STD_U32LE, {0, 999, 1000, 1000, 2500});
    integers("events/x", H5T_STD_U16LE, {1, 2, 3, 4, 639});
    integers("events/y", H5T_STD_U16LE, {5, 4, 3, 2, 479});
    integers("events/p", H5T_STD_U8LE, {0, 1, 0, 1, 1});
  }
  hid_t id() const { return file_; }

 private:
  hid_t file_;
};

class ForeignHdf5 : public testing::Test {
 protected:
  std::string message(const std::function<void(Builder&)>& build) {
    {
      Builder builder(path_);
      build(builder);
    }
    return message_of<UserError>([&] { read_everything(path_); });
  }

  TemporaryDirectory directory_;
  std::filesystem::path path_ = directory_.path() / "foreign.h5";
};

TEST_F(ForeignHdf5, DsecWithoutAttributesIsRead) {
  {
    Builder builder(path_);
    builder.dsec_columns();
    builder.integers("ms_to_idx", H5T_STD_U64LE, {0, 2, 4});
    builder.integers("t_offset", H5T_STD_I64LE, {49'599'300'000});
  }
  const EventsHdf5Reader reader(path_);
  EXPECT_EQ(reader.size(), 5u);
  EXPECT_FALSE(reader.width());
  EXPECT_FALSE(reader.complete());
  EXPECT_EQ(reader.unit(), TimeUnit::us);
  const TimeNs offset = 49'599'300'000 * kNsPerUs;
  EXPECT_EQ(reader.read(4, 1).at(0), (Event{offset + 2'500'000, 639, 479, 1}));
  EXPECT_EQ(reader.read_window(offset + 1'000'000, offset + 2'000'000).size(), 2u);
}

TEST_F(ForeignHdf5, IndexAndOffsetMayBeAbsentAndTypesDiffer) {
  {
    Builder builder(path_);
    builder.integers("events/t", H5T_STD_I64BE, {0, 999, 1000, 1000, 2500});
    builder.integers("events/x", H5T_STD_I32LE, {1, 2, 3, 4, 5});
    builder.integers("events/y", H5T_STD_U16BE, {5, 4, 3, 2, 1});
    builder.integers("events/p", H5T_STD_I8LE, {-1, 1, -1, 1, 1});
  }
  const EventsHdf5Reader reader(path_);
  EXPECT_EQ(reader.count_on(), 3u);
  EXPECT_EQ(reader.read(0, 1).at(0), (Event{0, 1, 5, -1}));
  EXPECT_EQ(reader.read_window(1'000'000, 2'000'000).size(), 2u);
}

TEST_F(ForeignHdf5, WhatIsWrongIsSaid) {
  const std::string path = path_.string();
  EXPECT_EQ(message([](Builder&) {}),
            "cannot read " + path + ": there is no dataset events/t, as in DSEC's layout; the file holds events");
  EXPECT_TRUE(contains(
      message([](Builder& builder) { builder.column<double>("events/t", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {1.0}); }),
      "events/t does not hold integers"));
  EXPECT_TRUE(contains(message([](Builder& builder) {
                         builder.column<std::int64_t>("events/t", H5T_STD_I64LE, H5T_NATIVE_INT64, {1, 2}, true);
                       }),
                       "events/t does not have one dimension"));
  EXPECT_TRUE(contains(message([](Builder& builder) {
                         H5Gclose(H5Gcreate2(builder.id(), "events/t", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
                       }),
                       "events/t is not a readable dataset"));
  EXPECT_TRUE(contains(message([](Builder& builder) {
                         builder.integers("events/t", H5T_STD_I64LE, {1, 2, 3});
                         builder.integers("events/x", H5T_STD_I64LE, {1, 2, 3});
                         builder.integers("events/y", H5T_STD_I64LE, {1, 2});
                         builder.integers("events/p", H5T_STD_I64LE, {1, 2, 3});
                       }),
                       "differ in length"));
  EXPECT_TRUE(contains(message([](Builder& builder) {
                         builder.integers("events/t", H5T_STD_I64LE, {1});
                         builder.integers("events/x", H5T_STD_I64LE, {-1});
                         builder.integers("events/y", H5T_STD_I64LE, {1});
                         builder.integers("events/p", H5T_STD_I64LE, {1});
                       }),
                       "event 0 at (-1, 1) is outside the image"));
  EXPECT_TRUE(contains(message([](Builder& builder) {
                         builder.integers("events/t", H5T_STD_I64LE, {std::numeric_limits<std::int64_t>::max()});
                         builder.integers("events/x", H5T_STD_I64LE, {1});
                         builder.integers("events/y", H5T_STD_I64LE, {1});
                         builder.integers("events/p", H5T_STD_I64LE, {1});
                       }),
                       "is too large"));
  EXPECT_TRUE(contains(message([](Builder& builder) {
                         builder.dsec_columns();
                         builder.integers("t_offset", H5T_STD_I64LE, {1, 2});
                       }),
                       "t_offset must be one integer"));
}

TEST_F(ForeignHdf5, LyingIndexIsNoticed) {
  for (const std::vector<std::int64_t>& index :
       {std::vector<std::int64_t>{0, 0, 0, 0, 0}, {0, 5, 5, 5, 5}, {5, 4, 3, 2, 1}, {0, 1'000'000, 2'000'000, 7, 7}}) {
    {
      Builder builder(path_);
      builder.dsec_columns();
      builder.integers("ms_to_idx", H5T_STD_U64LE, index);
    }
    const EventsHdf5Reader reader(path_);
    const auto text = message_of<UserError>([&] {
      EXPECT_EQ(reader.read_window(1'000'000, 2'000'000).size(), 2u);
      EXPECT_EQ(reader.read_window(2'000'000, 3'000'000).size(), 1u);
    });
    EXPECT_TRUE(contains(text, "ms_to_idx")) << index[1];
  }
}

TEST_F(ForeignHdf5, ClaimsOfSizeCostNothing) {
  const hsize_t huge = hsize_t{1} << 60;
  const auto claim = [&](H5D_layout_t layout, hsize_t chunk) {
    return message([&](Builder& builder) {
      for (const char* name : {"events/t", "events/x", "events/y", "events/p"}) {
        const hid_t space = H5Screate_simple(1, &huge, nullptr);
        const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
        H5Pset_layout(creation, layout);
        if (layout == H5D_CHUNKED) H5Pset_chunk(creation, 1, &chunk);
        H5Dclose(H5Dcreate2(builder.id(), name, H5T_STD_U8LE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
        H5Pclose(creation);
        H5Sclose(space);
      }
    });
  };
  EXPECT_TRUE(contains(claim(H5D_CHUNKED, 1 << 16), "but the file has fewer"));
  EXPECT_TRUE(contains(claim(H5D_CHUNKED, hsize_t{1} << 31), "chunks of 2147483648"));
  EXPECT_TRUE(contains(claim(H5D_CONTIGUOUS, 0), "but the file has fewer"));
}

}  // namespace
}  // namespace esim

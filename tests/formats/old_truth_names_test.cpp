// Recordings of older versions: the motion field was named flow, and optical flow displacement.

#include <gtest/gtest.h>
#include <hdf5.h>

#include "esim/formats/formats.h"
#include "esim/formats/hdf5/truth.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 4, kHeight = 3;
constexpr std::pair<const char*, const char*> kRenamed[] = {
    {"motion_field", "flow"}, {"optical_flow", "displacement"}, {"optical_flow_valid", "displacement_valid"}};

/// Three frames, and optical flow between them.
void write_to(Sink& sink) {
  sink.begin(test::recording_info(kWidth, kHeight, 0, kNsPerSecond));
  const Image<std::uint8_t> visible(kWidth, kHeight, 1);
  for (int k = 0; k < 3; ++k) {
    const test::TruthImages images(kWidth, kHeight, k);
    sink.write(images.at(k));
    if (k > 0) sink.write(OpticalFlowRecord{0, k - 1, k, images.motion_y, images.motion_x, visible});
  }
  sink.end(true);
}

bool same(const Image<float>& a, const Image<float>& b) { return std::ranges::equal(a.pixels(), b.pixels()); }

TEST(OldTruthNames, Hdf5) {
  const test::TemporaryDirectory directory;
  const fs::path path = directory.path() / "truth.h5";
  {
    TruthHdf5Writer writer(path, 0);
    write_to(writer);
  }
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  for (const auto& [now, before] : kRenamed) {
    EXPECT_EQ(H5Lexists(file, before, H5P_DEFAULT), 0) << "is written under its old name";
    ASSERT_GE(H5Lmove(file, now, file, before, H5P_DEFAULT, H5P_DEFAULT), 0) << now;
  }
  H5Fclose(file);

  const TruthHdf5Reader reader(path);
  ASSERT_EQ(reader.size(), 3U);
  ASSERT_EQ(reader.optical_flows(), 2U);
  const test::TruthImages expected(kWidth, kHeight, 2);
  TruthHdf5Reader::Frame frame;
  reader.read(2, frame);
  EXPECT_TRUE(same(frame.motion_x, expected.motion_x) && same(frame.motion_y, expected.motion_y));
  TruthHdf5Reader::OpticalFlow flow;
  reader.read(1, flow);
  EXPECT_TRUE(same(flow.x, expected.motion_y) && same(flow.y, expected.motion_x));
  EXPECT_EQ(flow.visible(3, 2), 1);
}

TEST(OldTruthNames, NumPy) {
  const test::TemporaryDirectory directory;
  const fs::path path = directory.path() / "arrays";
  write_to(*format_named("npy-truth").create(path, {}));
  for (const auto& [now, before] : kRenamed)
    fs::rename(path / (std::string(now) + ".npy"), path / (std::string(before) + ".npy"));
  fs::rename(path / "optical_flow_t.npy", path / "displacement_t.npy");

  const auto read = [&] {
    int frames = 0, flows = 0;
    const auto source = format_named("npy-truth").open(path, {});
    while (const Record* const record = source->next()) {
      if (const auto* const truth = std::get_if<TruthRecord>(record)) {
        const test::TruthImages expected(kWidth, kHeight, frames++);
        EXPECT_TRUE(same(truth->motion_x, expected.motion_x) && same(truth->motion_y, expected.motion_y));
      }
      if (const auto* const flow = std::get_if<OpticalFlowRecord>(record)) {
        const test::TruthImages expected(kWidth, kHeight, ++flows);
        EXPECT_EQ(flow->t1, flows);
        EXPECT_TRUE(same(flow->x, expected.motion_y) && same(flow->y, expected.motion_x));
      }
    }
    return std::pair(frames, flows);
  };
  EXPECT_EQ(read(), std::pair(3, 2));
  fs::remove(path / "t.npy");
  EXPECT_TRUE(format_named("npy-truth").recognises(path, ""));
  EXPECT_EQ(read(), std::pair(0, 2)) << "without frames";
}

}  // namespace
}  // namespace esim

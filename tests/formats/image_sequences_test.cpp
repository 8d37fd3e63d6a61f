// Ground truth as image files: the precision of each format, and damaged files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/files/npy_header.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 18, kHeight = 11, kFrames = 4;
constexpr TimeNs kStep = 50'000'000;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Moved {
  explicit Moved(int i)
      : x(kWidth, kHeight, 3.21F * static_cast<float>(i)), y(kWidth, kHeight, -1.5F), visible(kWidth, kHeight, 1) {
    x(2, 1) = y(2, 1) = kNaN;
    visible(2, 1) = visible(3, 1) = 0;
  }
  Image<float> x, y;
  Image<std::uint8_t> visible;
};

/// Copies of the records of a source.
struct Found {
  struct Frame {
    TimeNs t;
    SE3 pose;
    Image<float> irradiance, depth, motion_x, motion_y;
    Image<std::uint16_t> object;
  };
  struct OpticalFlowImages {
    TimeNs t0, t1;
    Image<float> x, y;
    Image<std::uint8_t> visible;
  };
  std::vector<Frame> frames;
  std::vector<OpticalFlowImages> moved;
  std::string order;
  RecordingInfo info;
};

Found read(const fs::path& path, const ReadOptions& options = {}) {
  Found found;
  const auto source = open_source(path, options);
  found.info = source->info();
  while (const Record* record = source->next()) {
    if (const auto* truth = std::get_if<TruthRecord>(record)) {
      found.order += 't';
      found.frames.push_back({truth->t, truth->T_world_camera, truth->irradiance, truth->depth, truth->motion_x,
                              truth->motion_y, truth->object != nullptr ? *truth->object : Image<std::uint16_t>()});
    } else {
      const auto& moved = std::get<OpticalFlowRecord>(*record);
      found.order += 'd';
      found.moved.push_back({moved.t0, moved.t1, moved.x, moved.y, moved.visible});
    }
  }
  return found;
}

void expect_near(const Image<float>& found, const Image<float>& expected, double tolerance) {
  ASSERT_EQ(found.bounds(), expected.bounds());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (std::isnan(expected.data()[i])) {
      ASSERT_TRUE(std::isnan(found.data()[i])) << i;
    } else if (std::isinf(expected.data()[i])) {
      ASSERT_EQ(found.data()[i], expected.data()[i]) << i;
    } else {
      ASSERT_NEAR(found.data()[i], expected.data()[i], tolerance) << i;
    }
  }
}

class ImageSequences : public testing::TestWithParam<std::string> {
 protected:
  /// Frames, with or without optical flow between them.
  fs::path write(const std::string& format, bool optical_flows) const {
    const fs::path path = base_.path() / format;
    const auto sink = format_named(format).create(path, {});
    sink->begin(test::recording_info(kWidth, kHeight, 0, kNsPerSecond));
    for (int i = 0; i < kFrames; ++i) {
      sink->write(
          test::TruthImages(kWidth, kHeight, i).at(i * kStep, {Eigen::Quaterniond::Identity(), {1, 2, 1.0 * i}}));
      const Moved moved(i);
      if (optical_flows && i > 0)
        sink->write(OpticalFlowRecord{0, (i - 1) * kStep, i * kStep, moved.x, moved.y, moved.visible});
    }
    sink->end(true);
    EXPECT_EQ(format_of(path).name, format);
    return path;
  }

  static void expect_optical_flows(const Found& found, double tolerance) {
    ASSERT_EQ(found.moved.size(), kFrames - 1U);
    for (int i = 1; i < kFrames; ++i) {
      const auto& [t0, t1, x, y, visible] = found.moved[static_cast<std::size_t>(i) - 1];
      EXPECT_EQ(t0, (i - 1) * kStep);
      EXPECT_EQ(t1, i * kStep);
      expect_near(x, Moved(i).x, tolerance);
      expect_near(y, Moved(i).y, tolerance);
      EXPECT_EQ(visible(0, 0), 1);
      EXPECT_EQ(visible(2, 1), 0) << "unknown flow is not visible";
    }
    EXPECT_EQ(found.info.cameras[0].model.width, kWidth);
    EXPECT_EQ(found.info.cameras[0].model.height, kHeight);
  }

  /// Without optical flow in the recording: the motion field times the interval.
  static void expect_motion_field(const Found& found, double tolerance) {
    ASSERT_EQ(found.moved.size(), kFrames - 1U);
    for (int i = 0; i + 1 < kFrames; ++i) {
      test::TruthImages images(kWidth, kHeight, i);
      for (float& value : images.motion_x.pixels()) value *= static_cast<float>(to_seconds(kStep));
      expect_near(found.moved[static_cast<std::size_t>(i)].x, images.motion_x, tolerance);
    }
  }

  test::TemporaryDirectory base_;
};

TEST_F(ImageSequences, FloKeepsFlowExactly) {
  const Found found = read(write("flo", true));
  expect_optical_flows(found, 0);
  EXPECT_EQ(found.order, "ddd");
  expect_motion_field(read(write("flo", false)), 1e-5);
}

TEST_F(ImageSequences, FloIsMiddleburys) {
  const std::string bytes = test::content(write("flo", true) / "000000.flo");
  ASSERT_EQ(bytes.size(), 12U + 8 * kWidth * kHeight);
  float tag = 0;
  std::memcpy(&tag, bytes.data(), 4);
  EXPECT_EQ(tag, 202021.25F) << "the benchmark's check for little-endian floats";
  float flow[2] = {}, unknown[2] = {};
  std::memcpy(flow, &bytes[12], 8);
  std::memcpy(unknown, &bytes[12 + 8 * (1 * kWidth + 2)], 8);
  EXPECT_EQ(flow[0], 3.21F);
  EXPECT_EQ(flow[1], -1.5F);
  EXPECT_GT(unknown[0], 1e9F);
}

TEST_F(ImageSequences, KittiKeepsFlowToA64thAndDepthToA256th) {
  const Found found = read(write("kitti", true));
  expect_optical_flows(found, 0.5 / 64);
  EXPECT_EQ(found.order, "ttdtdtd");
  ASSERT_EQ(found.frames.size(), static_cast<std::size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_EQ(found.frames[static_cast<std::size_t>(i)].t, i * kStep);
    expect_near(found.frames[static_cast<std::size_t>(i)].depth, test::TruthImages(kWidth, kHeight, i).depth,
                0.5 / 256);
  }
  expect_motion_field(read(write("kitti", false)), 0.5 / 64 + 1e-6);
}

TEST_F(ImageSequences, KittiDoesNotKnowWhatIsTooLarge) {
  const fs::path path = base_.path() / "kitti";
  const auto sink = format_named("kitti").create(path, {});
  sink->begin(test::recording_info(4, 1, 0, kNsPerSecond));
  test::TruthImages images(4, 1, 0);
  const float depths[] = {255.99F, 256.1F, 0.001F, 10.0F}, flows[] = {511.9F, 512.5F, -512.0F, -512.1F};
  for (int x = 0; x < 4; ++x)
    images.depth(x, 0) = depths[x], images.motion_x(x, 0) = flows[x], images.motion_y(x, 0) = 0;
  for (int i = 0; i < 2; ++i) sink->write(images.at(i * kNsPerSecond));
  sink->end(true);
  const Found found = read(path);
  const Image<float>& depth = found.frames[0].depth;
  EXPECT_NEAR(depth(0, 0), 255.99, 0.002);
  EXPECT_TRUE(std::isinf(depth(1, 0)));
  EXPECT_EQ(depth(2, 0), 1 / 256.0F) << "near, and not unknown";
  EXPECT_EQ(depth(3, 0), 10);
  const Image<float>& flow = found.moved[0].x;
  EXPECT_NEAR(flow(0, 0), 511.9, 0.01);
  EXPECT_TRUE(std::isnan(flow(1, 0)));
  EXPECT_EQ(flow(2, 0), -512);
  EXPECT_TRUE(std::isnan(flow(3, 0)));
}

TEST_F(ImageSequences, DsecKeepsFlowToA128thAndMicroseconds) {
  const fs::path path = write("dsec-flow", true);
  expect_optical_flows(read(path), 0.5 / 128);
  EXPECT_EQ(test::lines(path / "forward_timestamps.txt")[1], "0, 50000");
  fs::remove(path / "forward" / "000002.png");
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read(path); }), "only 2 files"));
}

TEST_F(ImageSequences, ExrKeepsIrradianceDepthAndMotionFieldExactly) {
  const Found found = read(write("exr", true));
  EXPECT_EQ(found.order, "tttt");
  for (int i = 0; i < kFrames; ++i) {
    const auto& frame = found.frames[static_cast<std::size_t>(i)];
    const test::TruthImages expected(kWidth, kHeight, i);
    EXPECT_EQ(frame.t, i * kStep);
    expect_near(frame.irradiance, expected.irradiance, 0);
    expect_near(frame.depth, expected.depth, 0);
    expect_near(frame.motion_x, expected.motion_x, 0);
    expect_near(frame.motion_y, expected.motion_y, 0);
  }
}

TEST_F(ImageSequences, NpyKeepsEverything) {
  const fs::path path = write("npy-truth", true);
  const Found found = read(path);
  EXPECT_EQ(found.order, "ttdtdtd");
  expect_optical_flows(found, 0);
  EXPECT_EQ(found.moved[0].visible(3, 1), 0) << "known, but occluded";
  for (int i = 0; i < kFrames; ++i) {
    const auto& frame = found.frames[static_cast<std::size_t>(i)];
    const test::TruthImages expected(kWidth, kHeight, i);
    EXPECT_EQ(frame.pose.translation.z(), i);
    expect_near(frame.irradiance, expected.irradiance, 0);
    expect_near(frame.depth, expected.depth, 0);
    expect_near(frame.motion_y, expected.motion_y, 0);
  }
  const std::string head = test::content(path / "motion_field.npy").substr(0, 192);
  EXPECT_TRUE(test::contains(head, "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 2, 11, 18), }"));
  EXPECT_EQ(head.back(), '\n');
  EXPECT_TRUE(test::contains(test::content(path / "t.npy").substr(0, 192), "'shape': (4,), }"));
}

TEST(NpyHeader, ReadsOtherVersionsAndRefusesDamage) {
  const test::TemporaryDirectory directory;
  const auto read_text = [&](const std::string& prefix, const std::string& text) {
    InputFile file(directory.write("a.npy", "\x93NUMPY" + prefix + text));
    return npy::read_header([&](std::span<std::byte> out) { return file.read_into(out); },
                            [&](const std::string& problem) { file.fail(0, problem); });
  };
  const std::string dictionary = "{'shape': (3,7), 'fortran_order': False, 'descr': '<f8'}";
  const auto length = static_cast<char>(dictionary.size());
  const npy::Header header = read_text(std::string{'\2', '\0', length, '\0', '\0', '\0'}, dictionary);
  EXPECT_EQ(header.descr.text, "<f8");
  EXPECT_EQ(header.shape, (std::vector<std::uint64_t>{3, 7}));
  for (const char* text :
       {"{'descr': '<f4', 'shape': (1,)}", "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}", ""}) {
    const std::string prefix{'\1', '\0', static_cast<char>(std::strlen(text)), '\0'};
    EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read_text(prefix, text); }), "a.npy")) << text;
  }
}

TEST_F(ImageSequences, NpyOfOtherLayoutsIsRefused) {
  const fs::path path = write("npy-truth", true);
  const std::string name = fs::relative(path / "motion_field.npy", base_.path()).string(),
                    sound = test::content(path / "motion_field.npy");
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"False", "True "},
                                 {"'<f4'", "'>f4'"},
                                 {"'<f4'", "[]   "},
                                 {"(4, 2, 11, 18)", "(4,22, 11, 18)"},
                                 {"(4, 2, 11, 18)", "(4, 2, 11)    "}}) {
    std::string other = sound;
    other.replace(other.find(from), from.size(), to);
    base_.write(name, other);
    EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read(path); }), "motion_field.npy")) << to;
  }
}

TEST_P(ImageSequences, CutAndDamagedFilesAreNamedOrHarmless) {
  const fs::path path = write(GetParam(), true);
  std::mt19937_64 random(3);
  const auto expect_no_harm = [&](const std::string& name) {
    try {
      read(path);
    } catch (const UserError& error) {
      EXPECT_TRUE(test::contains(error.what(), path.string())) << name << ": " << error.what();
    }
    ReadOptions options;
    options.recover = [](const std::string&) {};
    try {
      EXPECT_LE(read(path, options).order.size(), 2U * kFrames);
    } catch (const UserError&) {  // the file could not be read
    }
  };
  std::map<std::pair<fs::path, fs::path>, std::pair<fs::path, fs::path>> kinds;  // by folder and extension: two files
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    if (!entry.is_regular_file()) continue;
    const fs::path& file = entry.path();
    auto& [first, last] = kinds.try_emplace({file.parent_path(), file.extension()}, file, file).first->second;
    first = std::min(first, file), last = std::max(last, file);
  }
  std::set<fs::path> files;
  for (const auto& [kind, ends] : kinds) files.insert({ends.first, ends.second});
  for (const fs::path& file : files) {
    const std::string name = fs::relative(file, base_.path()).string(), sound = test::content(file);
    const std::size_t step = std::max<std::size_t>(1, sound.size() / 40);
    for (std::size_t size = 0; size < sound.size(); size += step) {
      base_.write(name, sound.substr(0, size));
      expect_no_harm(name);
    }
    for (int i = 0; i < 40; ++i) {
      std::string damaged = sound;
      for (std::uint64_t k = random() % 3 + 1; k > 0; --k) {
        const std::size_t range = i % 2 == 0 ? std::min<std::size_t>(sound.size(), 300) : sound.size();
        damaged[random() % range] = static_cast<char>(random());
      }
      base_.write(name, damaged);
      expect_no_harm(name);
    }
    base_.write(name, sound);
  }
}

TEST_P(ImageSequences, AFullDiskIsNamed) {
  const auto sink = format_named(GetParam()).create(base_.path() / "full", {});
  sink->begin(test::recording_info(256, 256, 0, kNsPerSecond));
  const test::FileSizeLimit limit(2048);
  const auto write_all = [&] {
    for (int i = 0; i < 3; ++i) sink->write(test::TruthImages(256, 256, i).at(i * kStep));
    sink->end(true);
  };
  EXPECT_TRUE(test::contains(test::message_of<OutputError>(write_all), "full"));
}

INSTANTIATE_TEST_SUITE_P(Formats, ImageSequences, testing::Values("flo", "kitti", "dsec-flow", "exr", "npy-truth"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(HostileImages, ClaimsOfSizeCostNothing) {
  const test::TemporaryDirectory directory;
  const auto message = [&](const char* list, const char* name, const std::string& bytes) {
    directory.write("timestamps.txt", list);
    directory.write(name, bytes);
    return test::message_of<UserError>([&] { read(directory.path()); });
  };
  const std::string size("\xff\xff\0\0\xff\xff\0\0", 8);  // 65535 x 65535 px
  EXPECT_TRUE(test::contains(message("0 0.0 0.1 a.flo\n", "a.flo", "PIEH" + size), "a.flo: at byte 12"));
  fs::create_directory(directory.path() / "depth");
  fs::remove(directory.path() / "timestamps.txt");
  directory.write("depth/timestamps.txt", "0 0.0 a.png\n");
  directory.write("depth/a.png", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\1\0\0\0\1\0\0\x10\0\0\0\0", 29));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read(directory.path()); }), "65536 x 65536 px"));
}

}  // namespace
}  // namespace esim

// The layout of the Event Camera Dataset, as a zip and as a folder, except for events, which every_format_test.cpp
// covers.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "esim/core/error.h"
#include "esim/formats/datasets/files_input.h"
#include "esim/formats/datasets/files_output.h"
#include "esim/formats/formats.h"
#include "formats/recorded.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kEnd = kNsPerSecond;

class DatasetFormat : public testing::TestWithParam<std::string> {
 protected:
  DatasetFormat() {
    Camera& camera = info_.cameras[0].model;
    camera.fx = 199.09, camera.fy = 198.82, camera.cx = 132.19, camera.cy = 110.71;
    camera.distortion = RadialTangential{-0.368, 0.151, -0.0003, -0.0008, 0.01};
    for (int i = 0; i < 5; ++i)
      frames_.push_back(test::gradient_frame(0, i * 200 * kNsPerMs, 64, 48, i < 4 ? 8 : 16, i));
    for (int i = 0; i < 1000; ++i) {
      ImuRecord imu{.t = i * kNsPerMs};
      imu.measured.angular_rate = Eigen::Vector3d(0.1 * i, -1, 1e-7);
      imu.measured.specific_force = Eigen::Vector3d(0, 9.81, -0.01 * i);
      imu_.push_back(imu);
      PoseRecord pose{.t = i * kNsPerMs};
      pose.body.T_world_body.translation = Eigen::Vector3d(0.001 * i, 1.0 / 3, -2);
      pose.body.T_world_body.rotation = Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d(1, 2, 3).normalized());
      poses_.push_back(pose);
    }
  }

  fs::path write() const {
    const fs::path path = base_.path() / (GetParam() == "dataset" ? "file.zip" : "folder");
    const auto sink = format_named(GetParam()).create(path, {});
    sink->begin(info_);
    test::write_in_batches(*sink, events_, 4096);
    for (const test::OwnedFrame& frame : frames_) sink->write(frame.record());
    for (const ImuRecord& imu : imu_) sink->write(imu);
    for (const PoseRecord& pose : poses_) sink->write(pose);
    sink->end(true);
    return path;
  }

  test::TemporaryDirectory base_;
  RecordingInfo info_ = test::recording_info(64, 48, 0, kEnd);
  std::vector<Event> events_ = test::random_events(150'000, 64, 48, 0, kEnd);
  std::vector<test::OwnedFrame> frames_;
  std::vector<ImuRecord> imu_;
  std::vector<PoseRecord> poses_;
};

TEST_P(DatasetFormat, EverythingReadsBack) {
  const fs::path path = write();
  EXPECT_EQ(format_of(path).name, GetParam());
  EXPECT_EQ(std::distance(fs::directory_iterator(base_.path()), {}), 1) << "no temporary files are left";
  const test::Recorded found = test::read_all(path);

  const Camera &camera = found.info.cameras.at(0).model, &was = info_.cameras[0].model;
  EXPECT_EQ(camera.width, 64);
  EXPECT_EQ(camera.height, 48);
  EXPECT_EQ(camera.fx, was.fx);
  EXPECT_EQ(camera.cy, was.cy);
  ASSERT_TRUE(std::holds_alternative<RadialTangential>(camera.distortion));
  EXPECT_EQ(std::get<RadialTangential>(camera.distortion).p2, std::get<RadialTangential>(was.distortion).p2);
  EXPECT_EQ(std::get<RadialTangential>(camera.distortion).k3, std::get<RadialTangential>(was.distortion).k3);
  EXPECT_TRUE(found.info.imu);
  EXPECT_EQ(found.info.start, 0);

  EXPECT_EQ(found.events.at(0), events_);
  ASSERT_EQ(found.frames.size(), frames_.size());
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    EXPECT_EQ(found.frames[i].t, frames_[i].t);
    EXPECT_EQ(found.frames[i].bits, frames_[i].bits);
    EXPECT_TRUE(std::ranges::equal(found.frames[i].image.pixels(), frames_[i].image.pixels())) << i;
  }
  ASSERT_EQ(found.imu.size(), imu_.size());
  ASSERT_EQ(found.poses.size(), poses_.size());
  for (std::size_t i = 0; i < imu_.size(); ++i) {
    EXPECT_EQ(found.imu[i].t, imu_[i].t);
    EXPECT_EQ(found.imu[i].measured.angular_rate, imu_[i].measured.angular_rate);
    EXPECT_EQ(found.imu[i].measured.specific_force, imu_[i].measured.specific_force);
    const SE3 &pose = found.poses[i].body.T_world_body, &pose_was = poses_[i].body.T_world_body;
    EXPECT_EQ(found.poses[i].t, poses_[i].t);
    EXPECT_EQ(pose.translation, pose_was.translation);
    EXPECT_LT(test::largest_difference(pose.rotation.coeffs(), pose_was.rotation.coeffs()), 1e-15);
  }
}

TEST_P(DatasetFormat, WhatIsNotRecordedIsNotThere) {
  frames_.clear(), imu_.clear(), poses_.clear();
  info_.cameras[0].model.distortion = Equidistant{};
  const fs::path path = write();
  if (GetParam() == "dataset-folder") {
    EXPECT_EQ(std::distance(fs::directory_iterator(path), {}), 1);
    EXPECT_TRUE(fs::exists(path / "events.txt"));
    return;
  }
  EXPECT_FALSE(open_zip_input(path, "events.txt")->has("calib.txt"));
  const test::Recorded found = test::read_all(path);
  EXPECT_EQ(found.events.at(0), events_);
  EXPECT_FALSE(found.info.imu);
  EXPECT_EQ(found.info.cameras[0].model.width, 0);
}

INSTANTIATE_TEST_SUITE_P(Layouts, DatasetFormat, testing::Values("dataset", "dataset-folder"),
                         [](const auto& test) { return test.param == "dataset" ? "zip" : "folder"; });

/// Makes a folder with these files, given by name and content.
fs::path make_folder(const test::TemporaryDirectory& base,
                     const std::vector<std::pair<std::string, std::string>>& files) {
  const fs::path folder = base.path() / "dataset";
  fs::remove_all(folder);
  for (const auto& [name, content] : files) {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << content;
  }
  return folder;
}

std::string problem_of(const fs::path& path) {
  return test::message_of<UserError>([&] { test::read_all(path); });
}

TEST(DatasetLayout, WrongLinesAreNamed) {
  const test::TemporaryDirectory base;
  const std::pair<std::string, std::string> events = {"events.txt", "0.1 1 2 0\n"};
  const auto problem = [&](const std::string& name, const std::string& content) {
    return problem_of(make_folder(base, {events, {name, content}}));
  };
  EXPECT_TRUE(test::contains(problem("imu.txt", "0 1 2 3 4 5 6\n1 2\n"), "imu.txt, line 2"));
  EXPECT_TRUE(test::contains(problem("imu.txt", "0 1 2 nan 4 5 6\n"), "\"nan\" is not a finite number"));
  EXPECT_TRUE(test::contains(problem("imu.txt", "1 1 2 3 4 5 6\n0.5 1 2 3 4 5 6\n"), "sort by time"));
  EXPECT_TRUE(test::contains(problem("groundtruth.txt", "0 1 2 3 0 0 0 2\n"), "unit norm"));
  EXPECT_TRUE(test::contains(problem("images.txt", "0 images/frame_00000000.png\n"), "is missing from the dataset"));
  EXPECT_TRUE(test::contains(problem("images.txt", "0 events.txt\n"), "not a PNG"));
  EXPECT_TRUE(test::contains(problem("calib.txt", "1 2 3\n"), "expected fx fy cx cy k1 k2 p1 p2 k3"));
  EXPECT_TRUE(test::contains(problem("imu.txt", std::string(1 << 20, '1')), "the line is too long"));
}

TEST(DatasetLayout, ImagesStayInsideTheDataset) {
  const test::TemporaryDirectory base;
  base.write("secret.png", "x");
  for (const std::string& name :
       {(base.path() / "secret.png").string(), std::string("../secret.png"), std::string("images/../../secret.png")}) {
    const fs::path folder =
        make_folder(base, {{"events.txt", ""}, {"images.txt", "0 " + name + "\n"}, {"images/a", ""}});
    EXPECT_TRUE(test::contains(problem_of(folder), "is missing from the dataset")) << name;
  }
}

TEST(DatasetLayout, AnImageThatClaimsToBeHugeTakesNoMemory) {
  const test::TemporaryDirectory base;
  std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x40\0\0\0\x40\0\x08\0\0\0\0", 29);
  const fs::path folder =
      make_folder(base, {{"events.txt", ""}, {"images.txt", "0 images/a.png\n"}, {"images/a.png", png}});
  EXPECT_TRUE(test::contains(problem_of(folder), "not a PNG, or it is damaged"));
}

TEST(DatasetLayout, ReportsATruncatedZip) {
  const test::TemporaryDirectory base;
  const fs::path path = base.path() / "a.zip";
  const auto frame = test::gradient_frame(0, 0, 64, 48, 8, 1);
  const auto sink = format_named("dataset").create(path, {});
  sink->begin(test::recording_info(64, 48, 0, kEnd));
  sink->write(frame.record());
  sink->end(true);
  const std::string bytes = test::content(path);
  const fs::path cut = base.write("cut.zip", bytes.substr(0, bytes.size() - 30));
  EXPECT_TRUE(test::contains(problem_of(cut), "cut.zip"));
  EXPECT_TRUE(test::contains(problem_of(cut), "the zip is truncated"));
}

std::string content_of(const FilesInput& files, const std::string& name) {
  const Read read = files.open(name);
  std::string content, block(10'000, '\0');
  while (const std::size_t count = read(std::as_writable_bytes(std::span(block)))) content += block.substr(0, count);
  return content;
}

TEST(ZipFiles, ReadBackFromAnyFolderOfTheZip) {
  const test::TemporaryDirectory base;
  const fs::path path = base.path() / "a.zip";
  std::string large;
  std::mt19937 random(1);
  for (int i = 0; i < 300'000; ++i) large += std::to_string(random() % 1000) + "\n";
  const auto out = make_zip_output(path);
  for (std::size_t at = 0; at < large.size(); at += 1000) out->append("b/c/large.txt", large.substr(at, 1000));
  out->append("b/c/empty.txt", "");
  out->add("b/c/d/stored", large.substr(0, 100'000));
  out->close();
  const auto in = open_zip_input(path, "large.txt");
  EXPECT_EQ(content_of(*in, "large.txt"), large);
  EXPECT_EQ(content_of(*in, "empty.txt"), "");
  EXPECT_EQ(content_of(*in, "d/stored"), large.substr(0, 100'000));
  EXPECT_EQ(in->size("large.txt"), large.size());
  EXPECT_FALSE(in->has("b/c/large.txt"));
  EXPECT_LT(fs::file_size(path), large.size());
}

TEST(ZipFiles, WrongContentIsNoticedByItsChecksum) {
  const test::TemporaryDirectory base;
  const fs::path path = base.path() / "a.zip";
  const auto out = make_zip_output(path);
  out->add("stored", "some content");
  out->close();
  std::string bytes = test::content(path);
  bytes[bytes.find("content")] = 'C';
  const fs::path damaged = base.write("b.zip", bytes);
  const auto in = open_zip_input(damaged, "stored");
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { content_of(*in, "stored"); }), "checksum"));
}

TEST(ZipFiles, AnUnfinishedZipIsAFolderThatCanBeRead) {
  const test::TemporaryDirectory base;
  const fs::path path = base.path() / "a.zip";
  const auto frame = test::gradient_frame(0, 0, 64, 48, 8, 1);
  const auto events = test::random_events(150'000, 64, 48, 0, kEnd);
  {
    const auto sink = format_named("dataset").create(path, {});
    sink->begin(test::recording_info(64, 48, 0, kEnd));
    test::write_in_batches(*sink, events, 4096);
    sink->write(frame.record());
    // The process ends here.
  }
  EXPECT_EQ(fs::file_size(path), 0U);
  const fs::path parts = base.path() / "a.zip.part";
  EXPECT_EQ(format_of(parts).name, "dataset-folder");
  EXPECT_TRUE(fs::exists(parts / "images/frame_00000000.png"));
  const auto source = open_source(parts);
  std::vector<Event> found;
  while (const Record* record = source->next()) {
    if (const auto* some = std::get_if<EventsRecord>(record))
      found.insert(found.end(), some->events.begin(), some->events.end());
  }
  ASSERT_GT(found.size(), events.size() / 2);
  EXPECT_TRUE(std::equal(found.begin(), found.end(), events.begin()));
}

TEST(ZipFiles, OnlyTheirOwnPartsAreRemoved) {
  const test::TemporaryDirectory base;
  fs::create_directories(base.path() / "a.zip.part" / "images");
  base.write("a.zip.part/images/mine.png", "x");
  const auto out = make_zip_output(base.path() / "a.zip");
  out->add("images/1.png", "1");
  out->add("other/2.png", "2");
  out->append("t.txt", "text");
  out->close();
  EXPECT_EQ(std::distance(fs::recursive_directory_iterator(base.path() / "a.zip.part"), {}), 2);
  EXPECT_EQ(test::content(base.path() / "a.zip.part/images/mine.png"), "x");
  EXPECT_FALSE(open_zip_input(base.path() / "a.zip", "t.txt")->has("images/mine.png"));
}

/// Programs that read zips from their start, such as cnpy, take the sizes from the header of each file.
TEST(ZipFiles, TheHeaderOfEachFileStatesItsSize) {
  const test::TemporaryDirectory base;
  const fs::path path = base.path() / "a.zip";
  const auto out = make_zip_output(path);
  out->add("stored", std::string(70'000, 's'));
  out->append("text", std::string(700'000, 't'));
  out->close();
  const std::string bytes = test::content(path);
  const auto number = [&](std::size_t at, std::size_t size) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::size_t{static_cast<std::uint8_t>(bytes.at(at + i))} << (8 * i);
    return value;
  };
  std::vector<std::size_t> sizes;
  std::size_t at = 0;
  while (bytes.compare(at, 4, "PK\x03\x04") == 0) {
    sizes.push_back(number(at + 22, 4));
    at += 30 + number(at + 26, 2) + number(at + 28, 2) + number(at + 18, 4);
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{70'000, 700'000}));
  EXPECT_EQ(bytes.compare(at, 4, "PK\x01\x02"), 0) << "the list of files follows";
}

TEST(ZipFiles, TheSameContentGivesTheSameBytes) {
  const test::TemporaryDirectory base;
  std::string bytes[2];
  for (std::string& content : bytes) {
    const auto out = make_zip_output(base.path() / "a.zip");
    out->append("t", "text");
    out->add("s", "stored");
    out->close();
    content = test::content(base.path() / "a.zip");
  }
  EXPECT_EQ(bytes[0], bytes[1]);
}

}  // namespace
}  // namespace esim

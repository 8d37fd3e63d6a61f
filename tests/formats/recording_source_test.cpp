// A recording's folder, written with RecordingWriter and read back as records.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "esim/core/colour/srgb.h"
#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/geometry/so3.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 24, kHeight = 16;

SE3 some_pose(double s) { return {so3_exp(Eigen::Vector3d(0.1, s, -0.3)), Eigen::Vector3d(s, 2, 1.0 / 3)}; }

Kinematics some_motion(double s) {
  return {some_pose(s), Eigen::Vector3d(s, 1.0 / 7, 2), Eigen::Vector3d(-1, s, 3), Eigen::Vector3d(1e-9, 2, s),
          Eigen::Vector3d(s, s, 5)};
}

void expect_same(const SE3& a, const SE3& b) {
  EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
  EXPECT_EQ(a.translation, b.translation);
}

void expect_same(const Kinematics& a, const Kinematics& b) {
  expect_same(a.T_world_body, b.T_world_body);
  EXPECT_EQ(a.velocity_world, b.velocity_world);
  EXPECT_EQ(a.acceleration_world, b.acceleration_world);
  EXPECT_EQ(a.omega_body, b.omega_body);
  EXPECT_EQ(a.alpha_body, b.alpha_body);
}

void expect_same(const InertialSignals& a, const InertialSignals& b) {
  EXPECT_EQ(a.angular_rate, b.angular_rate);
  EXPECT_EQ(a.specific_force, b.specific_force);
}

template <typename T>
void expect_same(const Image<T>& a, const Image<T>& b) {
  ASSERT_EQ(a.bounds(), b.bounds());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(static_cast<double>(a.data()[i])) && std::isnan(static_cast<double>(b.data()[i]))) continue;
    ASSERT_EQ(a.data()[i], b.data()[i]) << i;
  }
}

/// The rig of a simulation with everything: two cameras with different lenses, an IMU, an object and a sprite.
RecordingInfo rig() {
  RecordingInfo info;
  Camera left = Camera::from_fov(kWidth, kHeight, 1), right = left;
  left.distortion = RadialTangential{-0.1, 0.01, 1e-3, 2e-3, 0};
  right.fx = 30.25;
  info.cameras = {{"left", left, some_pose(0.1)}, {"right", right, some_pose(-0.4)}};
  info.imu = ImuInfo{some_pose(0.7), 400, 1e-3, 2e-5, 1e-2, 3e-4};
  info.start = kNsPerSecond;
  info.end = 2 * kNsPerSecond;
  info.objects = {"a car", "a/car"};
  info.sprites = {"sky"};
  return info;
}

constexpr int kSteps = 5;
constexpr TimeNs kStep = 100'000'003;

TimeNs time_of_step(int i) { return kNsPerSecond + i * kStep; }

PoseRecord pose_at(int i) {
  return {time_of_step(i),
          some_motion(0.1 * i),
          {some_motion(1.0 + i), some_motion(2.0 + i)},
          InertialSignals{{1e-3 * i, 2, 3}, {4, 5, 1.0 / 9}}};
}

ImuRecord imu_at(int i) {
  return {time_of_step(i), {{0.1 * i, 1.0 / 3, 2}, {0, 0, 9.81}}, {{1e-5, 2e-5, 3e-5 * i}, {0.1, 0.2, 0.3}}};
}

std::vector<Event> events_of(int camera) {
  return test::random_events(20'000, kWidth, kHeight, kNsPerSecond, 2 * kNsPerSecond - kNsPerMs,
                             static_cast<unsigned>(camera) + 1);
}

/// Images that a recording stores exactly: irradiance on levels of 8-bit sRGB.
test::TruthImages truth_at(int i) {
  test::TruthImages images(kWidth, kHeight, 0.1 * i);
  const Image<std::uint8_t> levels = encode_srgb(images.irradiance);
  Image<std::uint16_t> wide(kWidth, kHeight);
  std::copy_n(levels.data(), levels.size(), wide.data());
  images.irradiance = decode_srgb(wide, 8);
  return images;
}

Image<std::uint16_t> objects_at(int i) {
  return Image<std::uint16_t>(kWidth, kHeight, static_cast<std::uint16_t>(i % 4));
}

Image<float> optical_flow_at(int i, double scale) {
  Image<float> image(kWidth, kHeight, static_cast<float>(scale * i));
  image(1, 1) = std::numeric_limits<float>::quiet_NaN();
  return image;
}

Image<std::uint16_t> frame_at(int i, int bits) {
  Image<std::uint16_t> image(kWidth, kHeight);
  for (std::size_t k = 0; k < image.size(); ++k)
    image.data()[k] = static_cast<std::uint16_t>((k * 37 + static_cast<std::size_t>(i)) % (1U << bits));
  return image;
}

/// Writes everything as a simulation would: `left` has all kinds of records, `right` events and 12-bit frames.
void write_all(Sink& sink, TimeUnit unit) {
  const RecordingInfo info = rig();
  sink.begin(info);
  for (int camera = 0; camera < 2; ++camera) {
    std::vector<Event> events = events_of(camera);
    if (unit == TimeUnit::us) {
      for (Event& event : events) event.t -= event.t % kNsPerUs;
    }
    sink.write(EventsRecord{camera, events});
  }
  for (int i = 0; i < kSteps; ++i) {
    const TimeNs t = time_of_step(i);
    sink.write(pose_at(i));
    sink.write(imu_at(i));
    for (int camera = 0; camera < 2; ++camera) {
      const int bits = camera == 0 ? 8 : 12;
      const Image<std::uint16_t> frame = frame_at(i, bits);
      sink.write(FrameRecord{camera, t, t - 2'000'001, 4'000'003, 1.5, frame, bits});
    }
    const test::TruthImages images = truth_at(i);
    const Image<std::uint16_t> objects = objects_at(i);
    const SE3 poses[] = {some_pose(i), some_pose(i + 0.5)};
    sink.write(TruthRecord{0, t, some_pose(0.3 * i), images.irradiance, images.depth, images.motion_x, images.motion_y,
                           &objects, poses});
    if (i == 0) continue;
    const Image<float> x = optical_flow_at(i, 0.5), y = optical_flow_at(i, -3);
    const Image<std::uint8_t> visible(kWidth, kHeight, static_cast<std::uint8_t>(i % 2));
    sink.write(OpticalFlowRecord{0, time_of_step(i - 1), t, x, y, visible});
  }
  sink.end(true);
}

/// Reads all records, compares each with what was written, and counts them.
class Checker {
 public:
  void check(const Record& record) {
    std::visit([this](const auto& kind) { check_kind(kind); }, record);
    ++count[{content_of(record), camera_}];
    EXPECT_GE(first_, last_) << "portions of events end where other records are due";
    last_ = first_;
  }

  std::map<std::pair<Content, int>, int> count;
  std::vector<Event> events[2];

 private:
  int step_of(TimeNs t) {
    camera_ = 0;
    first_ = t;
    const int i = static_cast<int>((t - kNsPerSecond) / kStep);
    EXPECT_EQ(time_of_step(i), t);
    return i;
  }

  void check_kind(const EventsRecord& record) {
    camera_ = record.camera;
    first_ = record.events.front().t;
    events[camera_].insert(events[camera_].end(), record.events.begin(), record.events.end());
  }
  void check_kind(const PoseRecord& record) {
    const PoseRecord expected = pose_at(step_of(record.t));
    expect_same(record.body, expected.body);
    ASSERT_EQ(record.objects.size(), 2U);
    for (std::size_t k = 0; k < 2; ++k) expect_same(record.objects[k], expected.objects[k]);
    ASSERT_TRUE(record.imu_bias);
    expect_same(*record.imu_bias, *expected.imu_bias);
  }
  void check_kind(const ImuRecord& record) {
    const ImuRecord expected = imu_at(step_of(record.t));
    expect_same(record.measured, expected.measured);
    expect_same(record.bias, expected.bias);
  }
  void check_kind(const FrameRecord& record) {
    const int i = step_of(record.t);
    camera_ = record.camera;
    EXPECT_EQ(record.bits, record.camera == 0 ? 8 : 12);
    expect_same(record.image, frame_at(i, record.bits));
    EXPECT_EQ(record.exposure_start, record.t - 2'000'001);
    EXPECT_EQ(record.exposure_duration, 4'000'003);
    EXPECT_EQ(record.gain, 1.5);
  }
  void check_kind(const ImageRecord& record) { expect_same(record.irradiance, truth_at(step_of(record.t)).irradiance); }
  void check_kind(const TruthRecord& record) {
    const int i = step_of(record.t);
    const test::TruthImages expected = truth_at(i);
    expect_same(record.T_world_camera, some_pose(0.3 * i));
    expect_same(record.irradiance, expected.irradiance);
    expect_same(record.depth, expected.depth);
    expect_same(record.motion_x, expected.motion_x);
    expect_same(record.motion_y, expected.motion_y);
    ASSERT_NE(record.object, nullptr);
    expect_same(*record.object, objects_at(i));
    ASSERT_EQ(record.T_world_objects.size(), 2U);
    expect_same(record.T_world_objects[1], some_pose(i + 0.5));
  }
  void check_kind(const OpticalFlowRecord& record) {
    const int i = step_of(record.t1);
    EXPECT_EQ(record.t0, time_of_step(i - 1));
    expect_same(record.x, optical_flow_at(i, 0.5));
    expect_same(record.y, optical_flow_at(i, -3));
    EXPECT_EQ(record.visible(0, 0), i % 2);
  }
  void check_kind(const TriggerRecord&) { ADD_FAILURE() << "triggers are not read"; }
  void check_kind(const EventPointsRecord&) { ADD_FAILURE() << "event points are not read"; }

  int camera_ = 0;
  TimeNs first_ = 0, last_ = 0;
};

class RecordingFolder : public testing::Test {
 protected:
  void write(TimeUnit unit = TimeUnit::ns) {
    write_all(*format_named("recording").create(path_, WriteOptions{unit, Compression::gzip}), unit);
  }

  /// Damages one file and reads the folder with and without recovery: the error names the file.
  void expect_named(const std::string& file, const std::string& bytes) {
    const std::string sound = test::content(path_ / file);
    base_.write("out/" + file, bytes);
    EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read(path_); }), fs::path(file).filename().string()))
        << file;
    std::string problems;
    ReadOptions options;
    options.recover = [&](const std::string& problem) { problems += problem + "\n"; };
    const auto source = open_source(path_, options);
    int records = 0;
    while (source->next() != nullptr) ++records;
    EXPECT_TRUE(test::contains(problems, fs::path(file).filename().string())) << file;
    EXPECT_GT(records, 20) << "the other files are still read";
    base_.write("out/" + file, sound);
  }

  static Checker read(const fs::path& path) {
    Checker checker;
    const auto source = open_source(path);
    double progress = 0;
    while (const Record* record = source->next()) {
      checker.check(*record);
      EXPECT_GE(source->progress(), progress);
      progress = source->progress();
      EXPECT_LE(progress, 1);
    }
    return checker;
  }

  test::TemporaryDirectory base_;
  fs::path path_ = base_.path() / "out";
};

TEST_F(RecordingFolder, EveryRecordReadsBackInOneOrderOfTime) {
  write();
  ASSERT_EQ(format_of(path_).name, "recording");
  const Checker found = read(path_);
  EXPECT_EQ(found.events[0], events_of(0));
  EXPECT_EQ(found.events[1], events_of(1));
  const auto count = [&](Content content, int camera) { return found.count.at({content, camera}); };
  for (const Content content : {Content::poses, Content::imu, Content::truth, Content::frames})
    EXPECT_EQ(count(content, 0), kSteps) << describe(content);
  EXPECT_FALSE(found.count.contains({Content::images, 0})) << "the irradiance of the ground truth must not come twice";
  EXPECT_EQ(count(Content::frames, 1), kSteps);
  EXPECT_EQ(count(Content::optical_flow, 0), kSteps - 1);
  EXPECT_FALSE(fs::exists(path_ / "right" / "truth.h5")) << "no file without a record";
}

TEST_F(RecordingFolder, TheRigReadsBack) {
  write();
  const RecordingInfo expected = rig(), found = open_source(path_)->info();
  EXPECT_EQ(found.start, expected.start);
  EXPECT_EQ(found.end, expected.end);
  EXPECT_EQ(found.objects, expected.objects);
  EXPECT_EQ(found.sprites, expected.sprites);
  EXPECT_NEAR(found.truth_rate_hz, 10, 1e-6);
  ASSERT_EQ(found.cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(found.cameras[i].name, expected.cameras[i].name);
    EXPECT_EQ(found.cameras[i].model.width, kWidth);
    EXPECT_EQ(found.cameras[i].model.fx, expected.cameras[i].model.fx);
    EXPECT_EQ(found.cameras[i].model.distortion.index(), expected.cameras[i].model.distortion.index());
    EXPECT_LT(
        (found.cameras[i].T_body_camera.matrix() - expected.cameras[i].T_body_camera.matrix()).cwiseAbs().maxCoeff(),
        1e-12);
  }
  ASSERT_TRUE(found.imu);
  EXPECT_LT((found.imu->T_body_imu.matrix() - expected.imu->T_body_imu.matrix()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(found.imu->rate_hz, expected.imu->rate_hz);
  EXPECT_EQ(found.imu->accelerometer_random_walk, expected.imu->accelerometer_random_walk);
}

TEST_F(RecordingFolder, ACopyOfACopyIsTheSame) {
  write(TimeUnit::us);
  const fs::path copy = base_.path() / "copy.incomplete";
  const auto source = open_source(path_);
  const auto sink = format_named("recording").create(copy, WriteOptions{TimeUnit::us, Compression::gzip});
  sink->begin(source->info());
  while (const Record* record = source->next()) sink->write(*record);
  sink->end(true);
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path_)) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), path_);
    const std::string a = test::content(entry.path()), b = test::content(copy / name);
    if (name.parent_path() == "calibration") {
      EXPECT_EQ(std::count(a.begin(), a.end(), '\n'), std::count(b.begin(), b.end(), '\n')) << "rounding of poses";
    } else {
      EXPECT_TRUE(a == b) << name;
    }
    ++files;
  }
  EXPECT_GT(files, 30);
}

TEST_F(RecordingFolder, ACameraAloneIsItsFolder) {
  write();
  for (const char* path : {"left", "left/"}) {
    const auto source = open_source(path_ / path);
    ASSERT_EQ(source->info().cameras.size(), 1U);
    EXPECT_EQ(source->info().cameras[0].name, "left");
    EXPECT_EQ(source->info().cameras[0].model.fx, rig().cameras[0].model.fx) << "from the rig in the parent folder";
    EXPECT_FALSE(source->info().imu);
  }
  const auto source = open_source(path_ / "right");
  std::vector<Event> events;
  while (const Record* record = source->next()) {
    EXPECT_NE(content_of(*record), Content::poses);
    const auto* found = std::get_if<EventsRecord>(record);
    if (found == nullptr) continue;
    EXPECT_EQ(found->camera, 0) << "the only camera";
    events.insert(events.end(), found->events.begin(), found->events.end());
  }
  EXPECT_EQ(events, events_of(1));
}

TEST_F(RecordingFolder, WhatAKilledSimulationLeavesIsRead) {
  write();
  base_.write("out/report.json", "{\"status\": \"running\"}\n");
  const fs::path killed = base_.path() / "out.incomplete";
  fs::rename(path_, killed);
  EXPECT_EQ(read(killed).events[1], events_of(1));
  EXPECT_LE(open_source(killed)->info().start, time_of_step(0));
  EXPECT_EQ(open_source(killed)->info().end, rig().end) << "from events.h5";
  fs::remove_all(killed / "calibration");
  fs::remove(killed / "report.json");
  const RecordingInfo info = open_source(killed)->info();
  ASSERT_EQ(info.cameras.size(), 2U) << "the folders with a camera's files";
  EXPECT_EQ(info.cameras[1].model.width, kWidth) << "from the files themselves";
}

TEST_F(RecordingFolder, OfPureEventsHasNoOtherFiles) {
  const auto sink = format_named("recording").create(path_, {});
  const std::vector<Event> events = test::random_events(1000, 64, 48, 0, kNsPerSecond);
  test::record(*sink, test::recording_info(64, 48, 0, kNsPerSecond), events);
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(path_)) {
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), path_).string());
  }
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (std::vector<std::string>{"cam0/events.h5", "report.json"}));
}

TEST_F(RecordingFolder, DamagedFilesAreNamed) {
  write();
  for (const char* file : {"states.csv", "imu.csv", "imu_truth.csv", "objects/a_car_2.csv", "left/frames.csv",
                           "left/images/timestamps.txt", "left/frames/000002.png", "left/images/000001.png",
                           "left/events.h5", "left/truth.h5"}) {
    const std::string bytes = test::content(path_ / file);
    expect_named(file, bytes.substr(0, bytes.size() / 2) + (fs::path(file).extension() == ".png" ? "" : "\n1,oops\n"));
  }
  expect_named("report.json", "{\"cameras\": [{\"name\": \"left\"}]}");
  expect_named("calibration/rig.yaml", "cameras: [{camera: 1}]");
  expect_named("left/images/timestamps.txt", "0 1.0 ../../elsewhere.png\n");
  expect_named("objects/names.txt", "../../passwd root\n");
}

TEST_F(RecordingFolder, MissingFilesAreNamed) {
  write();
  for (const char* file : {"left/frames/000003.png", "objects/a_car.csv", "left/images/000000.png"}) {
    const std::string bytes = test::content(path_ / file);
    fs::remove(path_ / file);
    EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read(path_); }), fs::path(file).filename().string()));
    base_.write("out/" + std::string(file), bytes);
  }
}

TEST_F(RecordingFolder, OpticalFlowWithoutItsFramesIsRefused) {
  const auto sink = format_named("recording").create(path_, {});
  sink->begin(rig());
  const Image<float> x(kWidth, kHeight);
  const Image<std::uint8_t> visible(kWidth, kHeight);
  EXPECT_TRUE(test::contains(test::message_of<OutputError>([&] {
                               sink->write(OpticalFlowRecord{0, 1, 2, x, x, visible});
                             }),
                             "flo"));
}

}  // namespace
}  // namespace esim

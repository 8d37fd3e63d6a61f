// Recordings as ROS messages, in both bags and MCAP files.
#include <gtest/gtest.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/formats/ros/mcap/mcap_output.h"
#include "esim/formats/ros/messages/event_array.h"
#include "esim/formats/ros/messages/sensor_messages.h"
#include "esim/formats/ros/rosbag/rosbag_output.h"
#include "esim/formats/ros/rosbag2/sqlite_output.h"
#include "formats/ros_messages.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using ros::MessageType;

class RosFormats : public testing::TestWithParam<const char*> {
 protected:
  bool is_bag() const { return format_.name == "rosbag"; }
  ros::Encoding encoding() const { return is_bag() ? ros::Encoding::ros1 : ros::Encoding::cdr; }
  fs::path path() const { return base_.path() / ("recording" + format_.extension()); }

  std::unique_ptr<ros::MessageOutput> output() const {
    if (is_bag()) return std::make_unique<rosbag::RosbagOutput>(path(), ros::ChunkCodec::lz4);
    if (format_.folder) return std::make_unique<rosbag2::SqliteOutput>(path());
    return std::make_unique<mcap::McapOutput>(path(), ros::ChunkCodec::lz4);
  }

  template <typename T>
  void send(ros::MessageOutput& output, const std::string& topic, MessageType type, TimeNs t, const T& message) const {
    output.write(topic, type, t, test::encoded(message, encoding()));
  }

  void send_events(ros::MessageOutput& output, const std::string& topic, const std::vector<Event>& events, int width,
                   int height) const {
    std::string bytes;
    ros::MessageWriter writer(encoding(), bytes);
    writer(ros::EventArrayHead{{events.back().t, ""}, static_cast<unsigned>(height), static_cast<unsigned>(width)});
    ros::write_events(writer, events);
    output.write(topic, MessageType::events, events.back().t, bytes);
  }

  test::TemporaryDirectory base_;
  const Format& format_ = format_named(GetParam());
};

/// Two cameras, the second without events, an IMU and a moving object.
RecordingInfo rig() {
  RecordingInfo info = test::recording_info(31, 20, kNsPerSecond, 3 * kNsPerSecond);
  info.cameras[0].model.fx = 40, info.cameras[0].model.fy = 41.5;
  info.cameras[0].model.cx = 15.25, info.cameras[0].model.cy = 9.75;
  info.cameras[0].model.distortion = RadialTangential{-0.1, 0.01, 1e-3, -2e-3, 5e-4};
  info.cameras[0].T_body_camera = {Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized())),
                                   {0.1, 0.2, -0.3}};
  CameraInfo second;
  second.name = "right eye";
  second.model.width = 8, second.model.height = 6;
  second.model.fx = second.model.fy = 7;
  second.model.distortion = Equidistant{0.1, 0.2, 0.3, 0.4};
  info.cameras.push_back(second);
  for (CameraInfo& camera : info.cameras) camera.has_frames = true;
  info.imu.emplace().T_body_imu.translation = {0.01, 0.02, 0.03};
  info.objects = {"ball"};
  return info;
}

Eigen::Vector3d vector_at(double t, double phase) {
  return {std::sin(t + phase), std::cos(2 * t + phase), t - 3 * phase};
}

PoseRecord pose_at(TimeNs t) {
  const double s = to_seconds(t);
  PoseRecord pose;
  pose.t = t;
  pose.body.T_world_body = {Eigen::Quaterniond(Eigen::AngleAxisd(s, vector_at(s, 0).normalized())), vector_at(s, 1)};
  pose.body.velocity_world = vector_at(s, 2), pose.body.acceleration_world = vector_at(s, 3);
  pose.body.omega_body = vector_at(s, 4), pose.body.alpha_body = vector_at(s, 5);
  pose.objects.resize(1);
  pose.objects[0].T_world_body.translation = vector_at(s, 6);
  return pose;
}

void expect_equal(const SE3& a, const SE3& b, const char* what) {
  EXPECT_EQ(a.translation, b.translation) << what;
  EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs()) << what;
}

template <typename T>
bool same_pixels(const Image<T>& a, const Image<T>& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::equal(a.pixels().begin(), a.pixels().end(), b.pixels().begin());
}

TEST_P(RosFormats, EverythingReadsBackAsItWas) {
  const RecordingInfo info = rig();
  const std::vector<Event> events = test::random_events(120'000, 31, 20, info.start, info.end);
  Image<std::uint16_t> frame(31, 20), small(8, 6);
  for (std::size_t i = 0; i < frame.size(); ++i) frame.pixels()[i] = static_cast<std::uint16_t>(i % 1024);
  for (std::size_t i = 0; i < small.size(); ++i) small.pixels()[i] = static_cast<std::uint16_t>(i * 5);
  const test::TruthImages images(31, 20, 0.5);
  const SE3 T_world_camera = pose_at(1'234'567'891).body.T_world_body;

  const auto sink = format_.create(path(), {});
  sink->begin(info);
  std::size_t done = 0;
  for (TimeNs t = info.start; t <= info.end; t += 100 * kNsPerMs) {
    std::size_t count = 0;
    while (done + count < events.size() && events[done + count].t <= t) ++count;
    sink->write(EventsRecord{0, EventSpan(events).subspan(done, count)});
    done += count;
    sink->write(FrameRecord{0, t + 5, t - 7, 33 * kNsPerMs + 1, 1.5, frame, 10});
    sink->write(FrameRecord{1, t, t, 0, 1, small, 8});
    sink->write(pose_at(t + 1));
    sink->write(ImuRecord{t + 2, {vector_at(to_seconds(t), 7), vector_at(to_seconds(t), 8)}, {vector_at(1, 9), {}}});
    sink->write(images.at(t + 3, T_world_camera));
  }
  sink->end(true);

  const test::ReadBack all = test::read_back(path());
  EXPECT_FALSE(all.problem) << *all.problem;
  EXPECT_EQ(all.info.start, info.start);
  EXPECT_GE(all.info.end, events.back().t);
  ASSERT_EQ(all.info.cameras.size(), 2U);
  EXPECT_EQ(all.info.cameras[1].name, "right_eye") << "a valid ROS name";
  for (std::size_t i = 0; i < 2; ++i) {
    const Camera &a = all.info.cameras[i].model, &b = info.cameras[i].model;
    EXPECT_EQ(std::tie(a.width, a.height, a.fx, a.fy, a.cx, a.cy), std::tie(b.width, b.height, b.fx, b.fy, b.cx, b.cy));
    expect_equal(all.info.cameras[i].T_body_camera, info.cameras[i].T_body_camera, "T_body_camera");
  }
  EXPECT_EQ(std::get<RadialTangential>(all.info.cameras[0].model.distortion).p2, -2e-3);
  EXPECT_EQ(std::get<Equidistant>(all.info.cameras[1].model.distortion).k4, 0.4);
  ASSERT_TRUE(all.info.imu);
  expect_equal(all.info.imu->T_body_imu, info.imu->T_body_imu, "T_body_imu");
  EXPECT_EQ(all.info.objects, info.objects);

  EXPECT_EQ(all.events[0], events);
  EXPECT_TRUE(all.events[1].empty());
  ASSERT_EQ(all.frames.size(), 42U);
  ASSERT_EQ(all.truth.size(), 21U);
  ASSERT_EQ(all.poses.size(), 21U);
  ASSERT_EQ(all.imu.size(), 21U);
  EXPECT_TRUE(all.images.empty());
  for (std::size_t i = 0; i < 21; ++i) {
    const TimeNs t = info.start + static_cast<TimeNs>(i) * 100 * kNsPerMs;
    const test::ReadBack::Frame &a = all.frames[2 * i], &b = all.frames[2 * i + 1];
    EXPECT_EQ(std::tuple(a.camera, a.t, a.exposure_start, a.exposure_duration, a.gain, a.bits),
              std::tuple(0, t + 5, t - 7, 33 * kNsPerMs + 1, 1.5, 10));
    EXPECT_EQ(std::tuple(b.camera, b.t, b.bits), std::tuple(1, t, 8));
    EXPECT_TRUE(same_pixels(a.image, frame) && same_pixels(b.image, small));

    const test::ReadBack::Truth& truth = all.truth[i];
    EXPECT_EQ(truth.t, t + 3);
    expect_equal(truth.T_world_camera, T_world_camera, "T_world_camera");
    EXPECT_TRUE(same_pixels(truth.irradiance, images.irradiance) && same_pixels(truth.depth, images.depth));
    EXPECT_TRUE(same_pixels(truth.motion_x, images.motion_x) && same_pixels(truth.motion_y, images.motion_y));

    EXPECT_EQ(all.imu[i].t, t + 2);
    EXPECT_EQ(all.imu[i].measured.angular_rate, vector_at(to_seconds(t), 7));
    EXPECT_EQ(all.imu[i].measured.specific_force, vector_at(to_seconds(t), 8));
    EXPECT_EQ(all.imu[i].bias.angular_rate, vector_at(1, 9));

    const PoseRecord &pose = all.poses[i], expected = pose_at(t + 1);
    EXPECT_EQ(pose.t, expected.t);
    expect_equal(pose.body.T_world_body, expected.body.T_world_body, "T_world_body");
    EXPECT_EQ(pose.body.omega_body, expected.body.omega_body);
    EXPECT_EQ(pose.body.alpha_body, expected.body.alpha_body);
    // These were transformed to the body and back.
    EXPECT_LT(test::largest_difference(pose.body.velocity_world, expected.body.velocity_world), 1e-14);
    EXPECT_LT(test::largest_difference(pose.body.acceleration_world, expected.body.acceleration_world), 1e-14);
    expect_equal(pose.objects.at(0).T_world_body, expected.objects[0].T_world_body, "ball");
  }
}

TEST_P(RosFormats, FramesOfVideosAreIrradiance) {
  const RecordingInfo info = test::recording_info(31, 20, 0, kNsPerSecond);
  const test::TruthImages images(31, 20, 0.5);
  const auto sink = format_.create(path(), {});
  sink->begin(info);
  for (const TimeNs t : {0, 7, 9}) sink->write(ImageRecord{0, t, images.irradiance});
  sink->end(true);
  EXPECT_EQ(test::read_back(path()).images, (std::vector<TimeNs>{0, 7, 9}));
}

TEST_P(RosFormats, TimesThatRosCannotHoldAreRefused) {
  const TimeNs max = (is_bag() ? std::numeric_limits<std::uint32_t>::max()
                               : static_cast<TimeNs>(std::numeric_limits<std::int32_t>::max())) *
                         kNsPerSecond +
                     999'999'999;
  const RecordingInfo info = test::recording_info(4, 4, 0, 1);
  for (const TimeNs t : {TimeNs{-1}, max + 1}) {
    const auto sink = format_.create(path(), {});
    sink->begin(info);
    const std::vector<Event> events{{t, 1, 1, 1}};
    const std::string message = test::message_of<UserError>([&] { sink->write(EventsRecord{0, events}); });
    EXPECT_TRUE(test::contains(message, path().string()) && test::contains(message, "does not fit")) << message;
    EXPECT_THROW(sink->write(pose_at(t)), UserError);
  }
  const std::vector<Event> last{{max, 1, 1, 1}};
  test::record(*format_.create(path(), {}), info, last);
  EXPECT_EQ(test::read_back(path()).events[0], last);
}

TEST_P(RosFormats, ACutFileGivesWhatIsInItOnlyIfAskedTo) {
  if (format_.folder) GTEST_SKIP() << "EveryFormat cuts files of SQLite";
  const std::vector<Event> events = test::random_events(300'000, 31, 20, 0, 3 * kNsPerSecond);
  test::record(*format_.create(path(), {}), test::recording_info(31, 20, 0, 3 * kNsPerSecond), events);
  const std::string bytes = test::content(path());
  const fs::path cut = base_.write("cut", bytes.substr(0, bytes.size() * 2 / 3));

  const std::string message = test::message_of<UserError>([&] {
    const auto source = open_source(cut);
    while (source->next() != nullptr) continue;
  });
  EXPECT_TRUE(test::contains(message, "cannot read " + cut.string() + ": at byte ")) << message;
  const test::ReadBack rest = test::read_back(cut);
  EXPECT_EQ(rest.problem, message);
  ASSERT_GT(rest.events.at(0).size(), events.size() / 3);
  EXPECT_TRUE(std::equal(rest.events[0].begin(), rest.events[0].end(), events.begin()));
}

TEST_P(RosFormats, TopicsOfOthers) {
  const auto file = output();
  const std::vector<Event> events{{kNsPerSecond, 1, 2, 1}, {kNsPerSecond + 1, 2, 2, -1}};
  const std::string rgb("\x64\x00\x00\x00\x64\x00\x00\x00\x64", 9);
  for (const std::string side : {"left", "right"}) {
    send_events(*file, "/davis/" + side + "/events", events, 3 + (side == "left"), 3);
    const ros::ImageMessage image{{1, "x"}, 1, 3, "rgb8", 0, 9, ros::as_bytes(rgb)};
    send(*file, "/davis/" + side + "/image_raw", MessageType::image, 1, image);
  }
  const std::string grey(12, '\7');
  send(*file, "/davis/left/image_rect", MessageType::image, 2,
       ros::ImageMessage{{2, ""}, 3, 4, "mono8", 0, 4, ros::as_bytes(grey)});
  send(*file, "/davis/left/image_raw", MessageType::image, 3,
       ros::ImageMessage{{3, ""}, 3, 4, "mono8", 0, 4, ros::as_bytes(grey)});
  send(*file, "/vicon/pose", MessageType::pose, 4, ros::PoseMessage{{4, "w"}, {{1.25, 0, 0, 0}, {1, 2, 3}}});
  send(*file, "/davis/left/imu", MessageType::imu, 5, ros::ImuMessage{.header = {5, ""}});
  const std::string millimetres("\xe8\x03\x00\x00", 4);
  send(*file, "/depth_camera/depth/image", MessageType::image, 6,
       ros::ImageMessage{{6, ""}, 1, 2, "16UC1", 0, 4, ros::as_bytes(millimetres)});
  file->close();

  const test::ReadBack all = test::read_back(path());
  EXPECT_FALSE(all.problem) << *all.problem;
  ASSERT_EQ(all.info.cameras.size(), 3U);
  EXPECT_EQ(all.info.cameras[0].name, "davis_left");
  EXPECT_EQ(all.info.cameras[0].model.width, 4);
  EXPECT_EQ(all.info.cameras[1].name, "davis_right");
  EXPECT_EQ(all.info.cameras[1].model.width, 3);
  EXPECT_EQ(all.info.start, 1);
  EXPECT_EQ(all.events[0], events);
  ASSERT_EQ(all.frames.size(), 1U) << "only frames of the sensor's size, from one topic";
  EXPECT_EQ(all.frames[0].t, 3);
  EXPECT_EQ(all.frames[0].image(2, 2), 7);
  ASSERT_EQ(all.poses.size(), 1U);
  EXPECT_EQ(all.poses[0].body.T_world_body.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(all.poses[0].body.T_world_body.rotation.w(), 1) << "must have unit norm";
  EXPECT_EQ(all.imu.size(), 1U);
  ASSERT_EQ(all.truth.size(), 1U);
  EXPECT_EQ(all.truth[0].depth(0, 0), 1.0F) << "1000 mm";
  EXPECT_TRUE(std::isnan(all.truth[0].motion_x(0, 0)));
}

TEST_P(RosFormats, MessagesThatAreTooShortAreNamed) {
  const std::string whole = test::encoded(ros::ImuMessage{}, encoding());
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    const auto file = output();
    file->write("/imu", MessageType::imu, 1, whole.substr(0, size));
    file->close();
    const test::ReadBack all = test::read_back(path());
    EXPECT_TRUE(all.imu.empty());
    EXPECT_TRUE(all.problem && test::contains(*all.problem, "a message on /imu cannot be read")) << size;
  }
}

TEST_P(RosFormats, CountsAndSizesThatAreNotThereCostNoMemory) {
  const std::string few(64, '\0');
  const ros::Bytes data = ros::as_bytes(few);
  const auto expect_problem = [&](const std::string& topic, MessageType type, const std::string& payload) {
    const auto file = output();
    file->write(topic, type, 1, payload);
    file->close();
    const test::ReadBack all = test::read_back(path());
    EXPECT_TRUE(all.problem && test::contains(*all.problem, topic)) << topic;
  };
  const auto image = [&](unsigned height, unsigned width, unsigned step, const char* name) {
    return test::encoded(ros::ImageMessage{{1, ""}, height, width, name, 0, step, data}, encoding());
  };
  expect_problem("/cam0/image_raw", MessageType::image, image(65536, 65536, 65536, "mono8"));
  expect_problem("/cam0/image_raw", MessageType::image, image(65536, 65536, 0xffffffff, "mono16"));
  expect_problem("/cam0/depthmap", MessageType::image, image(4, 65536, 0, "32FC1"));
  expect_problem("/cam0/optic_flow", MessageType::flow,
                 test::encoded(ros::FlowMessage{{1, ""}, 0x10000, 0x10000, {data}, {data}}, encoding()));
  std::string events = test::encoded(ros::EventArrayHead{{1, ""}, 10, 10}, encoding());
  ros::append_number(events, 0xffffffffU);
  expect_problem("/cam0/events", MessageType::events, events + few);
  std::string transforms = encoding() == ros::Encoding::cdr ? std::string("\0\1\0\0", 4) : "";
  ros::append_number(transforms, 0xffffffffU);
  // Transforms are used only if they have a body, so one with a body comes first.
  const auto file = output();
  const ros::TransformsMessage body{{{{1, "map"}, "body", SE3()}}};
  send(*file, "/tf", MessageType::transforms, 1, body);
  file->write("/tf", MessageType::transforms, 2, transforms + few);
  file->close();
  const test::ReadBack all = test::read_back(path());
  EXPECT_EQ(all.poses.size(), 1U);
  EXPECT_TRUE(all.problem && test::contains(*all.problem, "/tf"));
}

INSTANTIATE_TEST_SUITE_P(Formats, RosFormats, testing::Values("rosbag", "mcap", "rosbag2"),
                         [](const auto& test) { return std::string(test.param); });

TEST(RosMessages, AlignmentInCdrIsThatOfTheStandard) {
  // Four bytes of header, seconds, nanoseconds, a string of one character with its zero, height at a multiple of 4.
  std::string bytes;
  ros::MessageWriter writer(ros::Encoding::cdr, bytes);
  writer(ros::EventArrayHead{{2 * kNsPerSecond + 5, "c"}, 3, 4});
  const std::vector<Event> events{{kNsPerSecond, 0x0102, 0x0304, 1}, {kNsPerSecond + 2, 0x0506, 0x0708, -1}};
  ros::write_events(writer, events);
  const std::string expected(
      "\0\1\0\0"
      "\2\0\0\0"
      "\5\0\0\0"
      "\2\0\0\0"
      "c\0\0\0"
      "\3\0\0\0"
      "\4\0\0\0"
      "\2\0\0\0"
      "\2\1\4\3"
      "\1\0\0\0"
      "\0\0\0\0"
      "\1\0\6\5"
      "\x8\x7\0\0"
      "\1\0\0\0"
      "\2\0\0\0"
      "\0",
      61);
  EXPECT_EQ(bytes, expected);
}

TEST(RosMessages, Ros1IsPacked) {
  std::string bytes;
  ros::MessageWriter writer(ros::Encoding::ros1, bytes);
  writer(ros::EventArrayHead{{2 * kNsPerSecond + 5, "c"}, 3, 4});
  const std::vector<Event> events{{kNsPerSecond, 0x0102, 0x0304, 1}, {kNsPerSecond + 2, 0x0506, 0x0708, -1}};
  ros::write_events(writer, events);
  const std::string expected(
      "\0\0\0\0"
      "\2\0\0\0"
      "\5\0\0\0"
      "\1\0\0\0"
      "c"
      "\3\0\0\0"
      "\4\0\0\0"
      "\2\0\0\0"
      "\2\1\4\3"
      "\1\0\0\0"
      "\0\0\0\0"
      "\1"
      "\6\5\x8\x7"
      "\1\0\0\0"
      "\2\0\0\0"
      "\0",
      55);
  EXPECT_EQ(bytes, expected);
}

TEST(RosMessages, ColoursBecomeLuma) {
  const std::string pixels("\xff\0\0\0\xff\0\0\0\xff\xff\xff\xff", 12);
  Image<std::uint16_t> frame;
  EXPECT_EQ(ros::to_frame({{}, 1, 4, "rgb8", 0, 12, ros::as_bytes(pixels)}, frame), 8);
  EXPECT_EQ(std::vector<std::uint16_t>(frame.pixels().begin(), frame.pixels().end()),
            (std::vector<std::uint16_t>{76, 150, 29, 255}));
  EXPECT_EQ(ros::to_frame({{}, 1, 4, "bgr8", 0, 12, ros::as_bytes(pixels)}, frame), 8);
  EXPECT_EQ(frame(0, 0), 29);
  EXPECT_EQ(ros::to_frame({{}, 1, 4, "yuv422", 0, 8, ros::as_bytes(pixels)}, frame), 0);
}

TEST(RosMessages, DistortionsThatAreNotKnownLeaveNoIntrinsics) {
  Camera camera;
  camera.width = 4, camera.height = 3, camera.fx = camera.fy = 2;
  ros::CameraInfoMessage message = ros::to_message(camera);
  EXPECT_EQ(ros::to_camera(message).fx, 2);
  message.distortion_model = "rational_polynomial", message.d = {0, 0, 0, 0, 0, 0.1, 0, 0};
  EXPECT_EQ(ros::to_camera(message).fx, 0);
  EXPECT_EQ(ros::to_camera(message).width, 4);
  message.distortion_model = "fov", message.d = {0.9};
  EXPECT_EQ(std::get<Fov>(ros::to_camera(message).distortion).w, 0.9);
}

}  // namespace
}  // namespace esim

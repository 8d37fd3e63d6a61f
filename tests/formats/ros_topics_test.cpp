// Images on the topics of bags and MCAP files, and files whose topics are not those of a recording.
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "esim/core/colour/srgb.h"
#include "esim/core/error.h"
#include "esim/formats/copy_recording.h"
#include "esim/formats/events_file.h"
#include "esim/formats/formats.h"
#include "esim/formats/inspect.h"
#include "esim/formats/ros/mcap/mcap_input.h"
#include "esim/formats/ros/mcap/mcap_output.h"
#include "esim/formats/ros/messages/event_array.h"
#include "esim/formats/ros/messages/sensor_messages.h"
#include "esim/formats/ros/rosbag/rosbag_input.h"
#include "esim/formats/ros/rosbag/rosbag_output.h"
#include "esim/formats/ros/rosbag2/bag_folder.h"
#include "esim/formats/ros/rosbag2/bag_input.h"
#include "esim/formats/ros/rosbag2/sqlite_output.h"
#include "formats/ros_messages.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;
using ros::MessageType;

class RosTopics : public testing::TestWithParam<const char*> {
 protected:
  bool is_bag() const { return format_.name == "rosbag"; }
  ros::Encoding encoding() const { return is_bag() ? ros::Encoding::ros1 : ros::Encoding::cdr; }
  fs::path path(const std::string& name = "recording") const { return base_.path() / (name + format_.extension()); }

  std::unique_ptr<ros::MessageOutput> output() const {
    if (is_bag()) return std::make_unique<rosbag::RosbagOutput>(path(), ros::ChunkCodec::none);
    if (format_.folder) return std::make_unique<rosbag2::SqliteOutput>(path());
    return std::make_unique<mcap::McapOutput>(path(), ros::ChunkCodec::none);
  }
  std::unique_ptr<ros::MessageInput> input() const {
    if (is_bag()) return std::make_unique<rosbag::RosbagInput>(path());
    if (format_.folder) return std::make_unique<rosbag2::BagInput>(rosbag2::files_of_bag(path()));
    return std::make_unique<mcap::McapInput>(path());
  }

  /// The number of messages on each topic.
  std::map<std::string, int> counts() const {
    std::map<std::string, int> result;
    const auto file = input();
    for (ros::Message message; file->next(message);) ++result[file->channels()[message.channel].topic];
    return result;
  }

  /// The images on a topic.
  std::vector<std::pair<TimeNs, Image<std::uint16_t>>> pictures(const std::string& topic) const {
    std::vector<std::pair<TimeNs, Image<std::uint16_t>>> result;
    const auto file = input();
    for (ros::Message message; file->next(message);) {
      if (file->channels()[message.channel].topic != topic) continue;
      ros::ImageMessage image;
      ros::MessageReader(encoding(), message.payload)(image);
      EXPECT_EQ(image.encoding, "mono8");
      EXPECT_EQ(ros::to_frame(image, result.emplace_back().second), 8);
      result.back().first = image.header.stamp;
    }
    return result;
  }

  /// Renames a message type in the file to a name of the same length.
  void rename_type(const std::string& from, const std::string& to) const {
    ASSERT_EQ(from.size(), to.size());
    const fs::path file = format_.folder ? path() / "bag_0.db3" : path();
    std::string bytes = test::content(file);
    ASSERT_NE(bytes.find(from), std::string::npos);
    for (std::size_t at = 0; (at = bytes.find(from, at)) != std::string::npos;) bytes.replace(at, from.size(), to);
    if (format_.name == "mcap") without_checksums(bytes);
    std::ofstream(file, std::ios::binary) << bytes;
  }

  /// The chunks of an MCAP file, which are records of a byte, a length, two times, a size and the checksum.
  static void without_checksums(std::string& bytes) {
    for (std::size_t at = mcap::kMagic.size(); at + 9 < bytes.size();) {
      std::uint64_t length = 0;
      std::memcpy(&length, bytes.data() + at + 1, sizeof length);
      if (static_cast<mcap::Op>(bytes[at]) == mcap::Op::chunk) bytes.replace(at + 9 + 24, 4, 4, '\0');
      at += 9 + length;
    }
  }

  fs::path convert(const fs::path& from, const char* format, const std::string& name) const {
    const fs::path to = base_.path() / name;
    convert_recording(from, format_named(format), to, {}, [](double) { return true; });
    return to;
  }

  test::TemporaryDirectory base_;
  const Format& format_ = format_named(GetParam());
  const RecordingInfo info_ = test::recording_info(31, 20, 0, kNsPerSecond);
};

constexpr int kFrames = 5;

void expect_picture(const Image<std::uint16_t>& picture, const Image<float>& irradiance) {
  const Image<std::uint8_t> levels = encode_srgb(irradiance);
  ASSERT_EQ(picture.size(), levels.size());
  EXPECT_TRUE(std::equal(levels.pixels().begin(), levels.pixels().end(), picture.pixels().begin()));
}

TEST_P(RosTopics, IrradianceHasAPictureWhereThereAreNoFrames) {
  const test::TruthImages images(31, 20, 0.5);
  const auto sink = format_.create(path(), {});
  sink->begin(info_);
  for (int i = 0; i < kFrames; ++i) sink->write(images.at(i * kNsPerMs, SE3()));
  sink->write(ImageRecord{0, kNsPerSecond, images.irradiance});
  sink->end(true);

  std::map<std::string, int> found = counts();
  EXPECT_EQ(found["/cam0/irradiance"], kFrames + 1);
  EXPECT_EQ(found["/cam0/image_raw"], kFrames + 1);
  EXPECT_EQ(found["/cam0/camera_info"], kFrames + 2) << "with every image, for image_pipeline";
  EXPECT_EQ(found["/cam0/depthmap"], kFrames);
  const auto shown = pictures("/cam0/image_raw");
  ASSERT_EQ(shown.size(), kFrames + 1U);
  EXPECT_EQ(shown[2].first, 2 * kNsPerMs);
  expect_picture(shown[2].second, images.irradiance);

  const test::ReadBack all = test::read_back(path());
  EXPECT_FALSE(all.problem) << *all.problem;
  EXPECT_TRUE(all.frames.empty()) << "images of irradiance are not frames of a frame camera";
  EXPECT_FALSE(all.info.cameras.at(0).has_frames);
  EXPECT_EQ(all.truth.size(), static_cast<std::size_t>(kFrames));
  EXPECT_EQ(all.images, std::vector<TimeNs>{kNsPerSecond});
}

TEST_P(RosTopics, FramesAreNotMixedWithPictures) {
  const test::TruthImages images(31, 20, 0.5);
  const Image<std::uint16_t> frame(31, 20, 7);
  for (const bool announced : {true, false}) {
    RecordingInfo info = info_;
    info.cameras[0].has_frames = announced;
    const auto sink = format_.create(path(), {});
    sink->begin(info);
    for (int i = 0; i < kFrames; ++i) {
      sink->write(images.at(i * kNsPerMs, SE3()));
      sink->write(FrameRecord{0, i * kNsPerMs + 5, i * kNsPerMs, 10, 1, frame, 8});
    }
    sink->end(true);
    EXPECT_EQ(counts()["/cam0/image_raw"], announced ? kFrames : 2 * kFrames);
    const test::ReadBack all = test::read_back(path());
    ASSERT_EQ(all.frames.size(), static_cast<std::size_t>(kFrames)) << announced;
    EXPECT_EQ(all.frames[1].t, kNsPerMs + 5);
    EXPECT_EQ(all.frames[1].image(3, 3), 7);
    EXPECT_TRUE(all.info.cameras[0].has_frames);
    EXPECT_EQ(all.truth.size(), static_cast<std::size_t>(kFrames));
  }
}

TEST_P(RosTopics, ARecordingHasEveryImageOnce) {
  const test::TruthImages images(31, 20, 0.5);
  const fs::path folder = base_.path() / "folder";
  const auto sink = format_named("recording").create(folder, {});
  sink->begin(info_);
  const std::vector<Event> events = test::random_events(1000, 31, 20, 0, kNsPerSecond);
  sink->write(EventsRecord{0, events});
  for (int i = 0; i < kFrames; ++i) sink->write(images.at(i * kNsPerMs, SE3()));
  sink->end(true);
  convert(folder, GetParam(), path().filename().string());
  EXPECT_EQ(counts()["/cam0/irradiance"], kFrames);
  EXPECT_EQ(counts()["/cam0/image_raw"], kFrames);

  // A second round trip changes nothing.
  const fs::path again = convert(path(), "recording", "again");
  EXPECT_EQ(std::distance(fs::directory_iterator(again / "cam0" / "images"), {}), kFrames + 1) << "and their list";
  convert(again, GetParam(), path("twice").filename().string());
  fs::remove_all(path());
  fs::rename(path("twice"), path());
  EXPECT_EQ(counts()["/cam0/irradiance"], kFrames);
}

TEST_P(RosTopics, FilesThatHaveTheIrradianceTwiceAreReadOnce) {
  const test::TruthImages images(31, 20, 0.5);
  const auto file = output();
  const auto send = [&](const char* topic, MessageType type, TimeNs t, auto message) {
    message.header.stamp = t;
    file->write(topic, type, t, test::encoded(message, encoding()));
  };
  for (TimeNs t = 0; t < kFrames; ++t) {
    for (int twice = 0; twice < 2; ++twice)
      send("/cam0/irradiance", MessageType::image, t, ros::to_message(images.irradiance));
    send("/cam0/depthmap", MessageType::image, t, ros::to_message(images.depth));
  }
  file->close();
  const test::ReadBack all = test::read_back(path());
  EXPECT_EQ(all.truth.size(), static_cast<std::size_t>(kFrames));
  EXPECT_TRUE(all.images.empty());
}

TEST_P(RosTopics, UnknownTypesAreNamed) {
  const auto file = output();
  const ros::ImuMessage imu{.header = {1, ""}};
  file->write("/event_camera/events", MessageType::imu, 1, test::encoded(imu, encoding()));
  file->write("/other/events", MessageType::imu, 2, test::encoded(imu, encoding()));
  file->close();
  rename_type(is_bag() ? "sensor_msgs/Imu" : "sensor_msgs/msg/Imu",
              is_bag() ? "vendor_msgs/Ray" : "vendor_msgs/msg/Ray");
  const auto expect_names = [&](const std::string& message) {
    for (const char* part : {"/event_camera/events", "/other/events", "vendor_msgs/", "Ray", "dvs_msgs/EventArray"})
      EXPECT_TRUE(test::contains(message, part)) << part;
    EXPECT_TRUE(test::contains(message, path().string()));
  };
  expect_names(test::message_of<UserError>([&] { open_source(path()); }));
  expect_names(test::message_of<UserError>([&] { convert(path(), "text", "events.txt"); }));
  expect_names(test::message_of<UserError>([&] { EventsFile{path()}; }));
  expect_names(test::message_of<UserError>([&] { inspect(path()); }));
  EXPECT_FALSE(fs::exists(base_.path() / "events.txt"));
}

TEST_P(RosTopics, ReportsUnknownTypesNextToOthers) {
  const ros::ImuMessage imu{.header = {1, ""}};
  const ros::PoseMessage pose{{1, "map"}, SE3()};
  {
    const auto file = output();
    file->write("/imu", MessageType::imu, 1, test::encoded(imu, encoding()));
    file->write("/event_camera/events", MessageType::pose, 1, test::encoded(pose, encoding()));
    file->close();
  }
  rename_type("geometry_msgs/", "vendors__msgs/");
  const Format& bag = format_named("rosbag");
  const CopySummary summary = convert_recording(path(), bag, base_.path() / "out.bag", {}, [](double) { return true; });
  EXPECT_EQ(summary.copied.at(Content::imu), 1U);
  ASSERT_EQ(losses(summary, bag).size(), 1U);
  EXPECT_TRUE(test::contains(losses(summary, bag)[0].what, "not read: /event_camera/events (vendors__msgs/"));
  const std::string message = test::message_of<UserError>([&] { EventsFile{path()}; });
  EXPECT_TRUE(
      test::contains(message, "has no camera and therefore no events; not read: /event_camera/events (vendors__msgs/"))
      << message;
  EXPECT_EQ(test::message_of<UserError>([&] { convert(path(), "text", "events.txt"); }), message);
  EXPECT_EQ(test::message_of<UserError>([&] { convert(path(), "dsec", "events.h5"); }), message);
  EXPECT_TRUE(test::contains(describe(inspect(path())), "not read\n  /event_camera/events (vendors__msgs/"));
}

TEST_P(RosTopics, ACameraWithoutEventsThatCanBeReadIsNoEmptyOne) {
  const ros::PoseMessage pose{{1, "map"}, SE3()};
  {
    const auto file = output();
    ros::CameraInfoMessage camera = ros::to_message(info_.cameras[0].model);
    file->write("/cam0/camera_info", MessageType::camera_info, 1, test::encoded(camera, encoding()));
    file->write("/cam0/events", MessageType::pose, 1, test::encoded(pose, encoding()));
    file->close();
  }
  rename_type("geometry_msgs/", "vendors__msgs/");
  const std::string message = test::message_of<UserError>([&] { convert(path(), "text", "events.txt"); });
  EXPECT_TRUE(test::contains(message, "/cam0/events (vendors__msgs/")) << message;
  EXPECT_FALSE(fs::exists(base_.path() / "events.txt"));
  EventsFile file(path());
  std::vector<Event> events;
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { file.read(events, 10); }), "/cam0/events (vendors__"));
}

TEST_P(RosTopics, ReportsUnsupportedEncodings) {
  const std::string data(8, '\0');
  const auto file = output();
  const ros::ImageMessage image{{1, ""}, 1, 4, "yuv422", 0, 8, ros::as_bytes(data)};
  file->write("/cam0/image_raw", MessageType::image, 1, test::encoded(image, encoding()));
  file->close();
  const std::string message = test::message_of<UserError>([&] { convert(path(), "rosbag", "out.bag"); });
  EXPECT_TRUE(test::contains(message, "/cam0/image_raw (images encoded as yuv422)")) << message;
}

TEST_P(RosTopics, NoTopicsAtAll) {
  output()->close();
  const std::string message = test::message_of<UserError>([&] { convert(path(), "text", "events.txt"); });
  EXPECT_TRUE(test::contains(message, is_bag() ? "has no camera and therefore no events" : "it holds no topics"))
      << message;
}

INSTANTIATE_TEST_SUITE_P(Formats, RosTopics, testing::Values("rosbag", "mcap", "rosbag2"),
                         [](const auto& test) { return std::string(test.param); });

/// A folder as of `ros2 bag record`, with the files that its metadata names.
fs::path write_bag(const test::TemporaryDirectory& base, const std::string& list, const std::string& more = "") {
  fs::create_directory(base.path() / "bag");
  base.write("bag/metadata.yaml", "rosbag2_bagfile_information:\n  relative_file_paths:" + list + "\n" + more);
  return base.path() / "bag";
}

void write_events(ros::MessageOutput& file, const std::vector<Event>& events) {
  std::string bytes;
  ros::MessageWriter writer(ros::Encoding::cdr, bytes);
  writer(ros::EventArrayHead{{events.back().t, ""}, 20, 31});
  ros::write_events(writer, events);
  file.write("/cam0/events", MessageType::events, events.back().t, bytes);
}

TEST(Ros2Bag, FilesOfBothKindsAreReadOneAfterAnother) {
  const test::TemporaryDirectory base;
  const std::vector<Event> events = test::random_events(3000, 31, 20, 0, kNsPerSecond);
  const auto part = [&](std::ptrdiff_t i) {
    return std::vector<Event>(events.begin() + i * 1000, events.begin() + (i + 1) * 1000);
  };
  const fs::path bag = write_bag(base, " [bag_0.db3, second.mcap, third/bag_0.db3]");
  for (const auto& [folder, i] : {std::pair{bag, 0}, {bag / "third", 2}}) {
    rosbag2::SqliteOutput file(folder);
    write_events(file, part(i));
    file.close();
  }
  mcap::McapOutput second(bag / "second.mcap", ros::ChunkCodec::zstd);
  write_events(second, part(1));
  second.close();
  write_bag(base, " [bag_0.db3, second.mcap, third/bag_0.db3]");  // SqliteOutput has replaced it
  const test::ReadBack all = test::read_back(bag);
  EXPECT_FALSE(all.problem) << *all.problem;
  EXPECT_EQ(all.events.at(0), events);
}

TEST(Ros2Bag, ErrorsNameFileAndReason) {
  const test::TemporaryDirectory base;
  const auto expect_error = [](const fs::path& path, const std::string& reason) {
    const std::string message = test::message_of<UserError>([&] { open_source(path); });
    EXPECT_TRUE(test::contains(message, path.string()) && test::contains(message, reason)) << message;
  };
  expect_error(base.write("text.db3", std::string("SQLite format 3\0 and more", 25)), "not a database");
  expect_error(base.write("empty.db3", std::string("SQLite format 3\0", 16)), "not a");
  {
    rosbag2::SqliteFile file(base.path() / "views.db3", rosbag2::SqliteFile::Access::create);
    file.execute("CREATE TABLE topics(id, name, type, serialization_format); CREATE VIEW messages AS SELECT 1 AS id");
  }
  expect_error(base.path() / "views.db3", "tables \"topics\" and \"messages\" are missing");
  expect_error(write_bag(base, " [bag_0.db3]"), "bag_0.db3");
  expect_error(write_bag(base, " [../bag_0.db3]"), "outside the bag");
  expect_error(write_bag(base, " [/etc/passwd]"), "outside the bag");
  expect_error(write_bag(base, " []"), "it lists no files");
  expect_error(write_bag(base, " {a: [}"), "line 2");
  expect_error(write_bag(base, " [bag_0.db3.zstd]", "  compression_mode: FILE\n"), "compressed");
  base.write("bag/metadata.yaml", "something: else\n");
  expect_error(base.path() / "bag", "rosbag2_bagfile_information");
}

/// Files of programs that compress each message, of a topic that is missing, and of a message that is damaged.
TEST(Ros2Bag, MessagesThatCannotBeRead) {
  const test::TemporaryDirectory base;
  const fs::path bag = base.path() / "bag", file = bag / "bag_0.db3";
  const std::vector<Event> events = test::random_events(1000, 31, 20, 0, kNsPerSecond);
  const auto changed = [&](const std::string& sql, const std::string& blob) {
    rosbag2::SqliteOutput output(bag);
    write_events(output, events);
    output.close();
    rosbag2::SqliteFile opened(file, rosbag2::SqliteFile::Access::create);
    rosbag2::SqliteStatement statement(opened, sql);
    if (!blob.empty()) statement.bind_blob(0, blob);
    statement.step();
  };
  std::string bytes, packed;
  ros::MessageWriter writer(ros::Encoding::cdr, bytes);
  writer(ros::EventArrayHead{{events.back().t, ""}, 20, 31});
  ros::write_events(writer, events);
  ros::compress(ros::ChunkCodec::zstd, bytes, packed);
  changed("UPDATE messages SET data = ?", packed);
  EXPECT_EQ(test::read_back(bag).events.at(0), events);
  const auto problem = [&] { return test::read_back(bag).problem.value_or("none"); };
  changed("UPDATE messages SET data = ?", packed.substr(0, packed.size() / 2));
  EXPECT_TRUE(test::contains(problem(), file.string() + ": message 1: ")) << problem();
  changed("UPDATE messages SET data = ?", bytes.substr(0, bytes.size() / 2));
  EXPECT_TRUE(test::contains(problem(), file.string() + ": message 1: ")) << problem();
  changed("UPDATE messages SET topic_id = 7", "");
  EXPECT_TRUE(test::contains(problem(), "message 1: its topic is unknown")) << problem();
}

}  // namespace
}  // namespace esim

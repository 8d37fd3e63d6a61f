#include "esim/formats/ros/rosbag2/rosbag2_format.h"

#include "esim/formats/ros/ros_sink.h"
#include "esim/formats/ros/ros_source.h"
#include "esim/formats/ros/rosbag2/bag_folder.h"
#include "esim/formats/ros/rosbag2/bag_input.h"
#include "esim/formats/ros/rosbag2/sqlite_output.h"

namespace esim::inline formats {
namespace {

std::unique_ptr<Sink> make_sink(const std::filesystem::path& path, const WriteOptions&,
                                std::optional<ros::PacketEncoding> packets) {
  return ros::make_sink(path, ros::Encoding::cdr, packets,
                        [path] { return std::make_unique<rosbag2::SqliteOutput>(path); });
}

}  // namespace

Format rosbag2_format() {
  return {
      .name = "rosbag2",
      .description = "folder of a ROS 2 bag in SQLite: dvs_msgs, sensor_msgs, geometry_msgs, tf2_msgs",
      .holds = {Content::events, Content::frames, Content::images, Content::imu, Content::poses, Content::truth},
      .several_cameras = true,
      .folder = true,
      .recognises =
          [](const auto& path, std::string_view) {
            std::error_code error;
            return std::filesystem::is_regular_file(path / rosbag2::kMetadataFile, error);
          },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return ros::make_source(
                path, [path] { return std::make_unique<rosbag2::BagInput>(rosbag2::files_of_bag(path)); }, options);
          },
      .create = [](const auto& path, const WriteOptions& options) { return make_sink(path, options, std::nullopt); },
  };
}

Format rosbag2_packets_format() {
  return ros::with_packets(rosbag2_format(), "rosbag2-packets",
                           "folder of a ROS 2 bag in SQLite: event_camera_msgs, sensor_msgs, geometry_msgs, tf2_msgs",
                           make_sink);
}

Format rosbag2_file_format() {
  return {
      .name = "db3",
      .description = "an SQLite file of a ROS 2 bag",
      .holds = rosbag2_format().holds,
      .several_cameras = true,
      .recognises = [](const auto&, std::string_view head) { return head.starts_with("SQLite format 3"); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return ros::make_source(
                path, [path] { return std::make_unique<rosbag2::BagInput>(std::vector{path}); }, options);
          },
  };
}

}  // namespace esim::inline formats

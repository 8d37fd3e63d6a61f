#include "esim/formats/ros/rosbag/rosbag_format.h"

#include "esim/formats/ros/ros_sink.h"
#include "esim/formats/ros/ros_source.h"
#include "esim/formats/ros/rosbag/rosbag_input.h"
#include "esim/formats/ros/rosbag/rosbag_output.h"

namespace esim::inline formats {
namespace {

std::unique_ptr<Sink> make_sink(const std::filesystem::path& path, const WriteOptions& options,
                                std::optional<ros::PacketEncoding> packets) {
  const auto codec = options.compression == Compression::none ? ros::ChunkCodec::none : ros::ChunkCodec::lz4;
  return ros::make_sink(path, ros::Encoding::ros1, packets,
                        [=] { return std::make_unique<rosbag::RosbagOutput>(path, codec); });
}

}  // namespace

Format rosbag_format() {
  return {
      .name = "rosbag",
      .description = "ROS 1 bag: dvs_msgs, sensor_msgs, geometry_msgs, tf2_msgs",
      .extensions = {".bag"},
      .holds = {Content::events, Content::frames, Content::images, Content::imu, Content::poses, Content::truth},
      .several_cameras = true,
      .recognises = [](const auto&, std::string_view head) { return head.starts_with("#ROSBAG V"); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return ros::make_source(
                path, [path] { return std::make_unique<rosbag::RosbagInput>(path); }, options);
          },
      .create = [](const auto& path, const WriteOptions& options) { return make_sink(path, options, std::nullopt); },
  };
}

Format rosbag_packets_format() {
  return ros::with_packets(rosbag_format(), "rosbag-packets",
                           "ROS 1 bag: event_camera_msgs, sensor_msgs, geometry_msgs, tf2_msgs", make_sink);
}

}  // namespace esim::inline formats

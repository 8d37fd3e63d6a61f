#include "esim/formats/ros/mcap/mcap_format.h"

#include "esim/formats/ros/mcap/mcap_input.h"
#include "esim/formats/ros/mcap/mcap_output.h"
#include "esim/formats/ros/ros_sink.h"
#include "esim/formats/ros/ros_source.h"

namespace esim::inline formats {
namespace {

std::unique_ptr<Sink> make_sink(const std::filesystem::path& path, const WriteOptions& options,
                                std::optional<ros::PacketEncoding> packets) {
  const auto codec = options.compression == Compression::none ? ros::ChunkCodec::none : ros::ChunkCodec::zstd;
  return ros::make_sink(path, ros::Encoding::cdr, packets,
                        [=] { return std::make_unique<mcap::McapOutput>(path, codec); });
}

}  // namespace

Format mcap_format() {
  return {
      .name = "mcap",
      .description = "MCAP of ROS 2: dvs_msgs, sensor_msgs, geometry_msgs, tf2_msgs",
      .extensions = {".mcap"},
      .holds = {Content::events, Content::frames, Content::images, Content::imu, Content::poses, Content::truth},
      .several_cameras = true,
      .recognises = [](const auto&, std::string_view head) { return head.starts_with(mcap::kMagic); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return ros::make_source(
                path, [path] { return std::make_unique<mcap::McapInput>(path); }, options);
          },
      .create = [](const auto& path, const WriteOptions& options) { return make_sink(path, options, std::nullopt); },
  };
}

Format mcap_packets_format() {
  return ros::with_packets(mcap_format(), "mcap-packets",
                           "MCAP of ROS 2: event_camera_msgs, sensor_msgs, geometry_msgs, tf2_msgs", make_sink);
}

}  // namespace esim::inline formats

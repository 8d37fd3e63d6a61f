#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "esim/formats/ros/messages/message_codec.h"

namespace esim::inline formats::ros {

/// The supported message types.
enum class MessageType {
  events,
  image,
  camera_info,
  imu,
  pose,
  twist,
  accel,
  transforms,
  flow,
  frame_info,
  event_packet,
  clock,
  odometry
};

/// The name in ROS 1: "sensor_msgs/Image".
std::string_view name_of(MessageType type);

/// The name in ROS 2: "sensor_msgs/msg/Image".
std::string ros2_name_of(MessageType type);

/// The type of this name in ROS 1 or ROS 2, or of another name for the same fields; nothing for all others.
std::optional<MessageType> type_named(std::string_view name);

/// All ROS 1 names that type_named() knows, for messages.
std::string known_names();

/// The type's definition, followed by those of all types that it contains, as in bags and MCAP files.
std::string definition_of(MessageType type, Encoding encoding);

/// The MD5 sum that identifies the version of a type in ROS 1.
std::string_view md5_of(MessageType type);

}  // namespace esim::inline formats::ros

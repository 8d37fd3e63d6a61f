#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "esim/record/formats/ros/message_codec.h"

namespace esim::ros {

/// The types of message that are written and read.
enum class MessageType { events, image, camera_info, imu, pose, twist, accel, transforms, flow, frame_info };

/// As in ROS 1: "sensor_msgs/Image".
std::string_view name_of(MessageType type);

/// As in ROS 2: "sensor_msgs/msg/Image".
std::string ros2_name_of(MessageType type);

/// The type of that name, of ROS 1 or ROS 2, or of another name for the same fields; nothing for all others.
std::optional<MessageType> type_named(std::string_view name);

/// All names that type_named() knows, as in ROS 1, for people.
std::string known_names();

/// The type's definition, followed by those of all types in it, as bags and MCAP files hold it.
std::string definition_of(MessageType type, Encoding encoding);

/// The MD5 sum by which ROS 1 tells versions of a type apart.
std::string_view md5_of(MessageType type);

}  // namespace esim::ros

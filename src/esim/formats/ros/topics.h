#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "esim/formats/ros/message_file.h"

namespace esim::inline formats::ros {

/// The topics of a camera named cam0 are /cam0/events and so on.
namespace topic {
inline constexpr std::string_view kEvents = "events";
inline constexpr std::string_view kCameraInfo = "camera_info";
inline constexpr std::string_view kFrame = "image_raw";
inline constexpr std::string_view kFrameInfo = "frame_info";
inline constexpr std::string_view kIrradiance = "irradiance";
inline constexpr std::string_view kDepth = "depthmap";
inline constexpr std::string_view kFlow = "optic_flow";
inline constexpr std::string_view kTruthPose = "truth_pose";
inline constexpr std::string_view kPose = "pose";
inline constexpr std::string_view kTwist = "twist";

inline constexpr std::string_view kImu = "/imu";
inline constexpr std::string_view kImuBias = "/imu_bias";
inline constexpr std::string_view kBodyTwist = "/body/twist";
inline constexpr std::string_view kBodyAccel = "/body/accel";
inline constexpr std::string_view kTransforms = "/tf";
inline constexpr std::string_view kStaticTransforms = "/tf_static";
}  // namespace topic

/// Frame names of transforms; cameras and objects use their own names.
namespace frame {
inline constexpr std::string_view kWorld = "map";
inline constexpr std::string_view kBody = "body";
inline constexpr std::string_view kImu = "imu";
}  // namespace frame

/// A valid ROS name: letters, digits and underscores.
std::string ros_name(std::string_view name);

/// "/cam0/events"
std::string camera_topic(std::string_view camera, std::string_view leaf);

/// The role of the messages of a channel in a recording.
enum class Role {
  none,
  events,
  camera_info,
  frame,
  frame_info,
  irradiance,
  depth,
  flow,
  truth_pose,
  imu,
  imu_bias,
  body_pose,
  body_transform,
  body_twist,
  body_accel,
};

struct Assignment {
  Role role = Role::none;
  int camera = 0;
};

struct Assignments {
  std::vector<std::string> cameras{};  ///< their names
  std::vector<Assignment> of_channels{};
};

/// Each path with a topic of events is a camera, and so is each path with images that is not below such a path: with
/// /dvs/events and /dvs/left/image_raw, the camera is dvs. If several topics could be the frames of a camera,
/// "image_corrupted" is chosen, as in the original ESIM, then "image_raw", then the first. However, image_raw next to
/// irradiance, without frame_info, is a picture of the irradiance. Of several IMUs, /imu is chosen, then the first.
/// Poses of the body come from the transforms if these contain a body, otherwise from "pose", then the first.
Assignments assign_roles(const std::vector<Channel>& channels, bool transforms_have_body);

}  // namespace esim::inline formats::ros

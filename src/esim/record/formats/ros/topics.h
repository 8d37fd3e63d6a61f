#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "esim/record/formats/ros/message_file.h"

namespace esim::ros {

/// Topics of a camera named cam0 are /cam0/events and so on.
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

/// Frames of transforms; cameras and objects are frames of their names.
namespace frame {
inline constexpr std::string_view kWorld = "map";
inline constexpr std::string_view kBody = "body";
inline constexpr std::string_view kImu = "imu";
}  // namespace frame

/// A name as ROS takes it: letters, digits and underscores.
std::string ros_name(std::string_view name);

/// "/cam0/events"
std::string camera_topic(std::string_view camera, std::string_view leaf);

/// What the messages of a channel are to a recording.
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

/// A camera is each path with a topic of events, and each path with images that is not below such a one: of
/// /dvs/events and /dvs/left/image_raw the camera is dvs. Of several topics that could be the frames of a camera
/// "image_corrupted" is taken, as the original ESIM has it, then "image_raw", then the first; but image_raw beside
/// irradiance, without frame_info, is a picture of that. Of several IMUs /imu is taken, then the first. Poses of the
/// body are those of the transforms where these have a body, otherwise of "pose", then the first.
Assignments assign_roles(const std::vector<Channel>& channels, bool transforms_have_body);

}  // namespace esim::ros

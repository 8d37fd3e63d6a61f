#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "esim/formats/ros/messages/message_codec.h"
#include "esim/geometry/se3.h"

namespace esim::inline formats::ros {

/// The ROS messages of recordings, each with its fields in their order, for a MessageWriter or MessageReader. Their
/// definitions are in message_types.cpp; the events, which are many, are in event_array.h.

struct Header {
  TimeNs stamp = 0;
  std::string frame_id{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive.sequence_number();
    archive.time(self.stamp);
    archive(self.frame_id);
  }
};

/// sensor_msgs/Image
struct ImageMessage {
  Header header{};
  std::uint32_t height = 0, width = 0;
  std::string encoding{};  ///< mono8, mono16, 32FC1, ...
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes of a row
  Bytes data{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.height, self.width, self.encoding, self.is_bigendian, self.step, self.data);
  }
};

/// sensor_msgs/CameraInfo
struct CameraInfoMessage {
  Header header{};
  std::uint32_t height = 0, width = 0;
  std::string distortion_model{};
  std::vector<double> d{};
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  std::uint32_t roi_x = 0, roi_y = 0, roi_height = 0, roi_width = 0;
  std::uint8_t roi_do_rectify = 0;

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.height, self.width, self.distortion_model, self.d, self.k, self.r, self.p);
    archive(self.binning_x, self.binning_y);
    archive(self.roi_x, self.roi_y, self.roi_height, self.roi_width, self.roi_do_rectify);
  }
};

/// sensor_msgs/Imu
struct ImuMessage {
  Header header{};
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  std::array<double, 9> orientation_covariance{-1};  ///< -1: no orientation
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  std::array<double, 9> angular_velocity_covariance{};
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();
  std::array<double, 9> linear_acceleration_covariance{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.orientation, self.orientation_covariance);
    archive(self.angular_velocity, self.angular_velocity_covariance);
    archive(self.linear_acceleration, self.linear_acceleration_covariance);
  }
};

/// geometry_msgs/PoseStamped: in the header's frame
struct PoseMessage {
  Header header{};
  SE3 pose{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.pose.translation, self.pose.rotation);
  }
};

/// geometry_msgs/TwistStamped and geometry_msgs/AccelStamped
struct TwistMessage {
  Header header{};
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.linear, self.angular);
  }
};

/// rosgraph_msgs/Clock
struct ClockMessage {
  TimeNs t = 0;

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive.time(self.t);
  }
};

/// nav_msgs/Odometry: the pose in the header's frame, the twist in the child's
struct OdometryMessage {
  Header header{};
  std::string child_frame_id{};
  SE3 pose{};
  std::array<double, 36> pose_covariance{};
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();
  std::array<double, 36> twist_covariance{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.child_frame_id, self.pose.translation, self.pose.rotation, self.pose_covariance);
    archive(self.linear, self.angular, self.twist_covariance);
  }
};

/// geometry_msgs/TransformStamped
struct TransformMessage {
  Header header{};
  std::string child_frame_id{};
  SE3 T_frame_child{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.child_frame_id, self.T_frame_child.translation, self.T_frame_child.rotation);
  }
};

/// tf2_msgs/TFMessage
struct TransformsMessage {
  std::vector<TransformMessage> transforms{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.transforms);
  }
};

/// esim_msgs/OpticFlow
struct FlowMessage {
  Header header{};
  std::uint32_t height = 0, width = 0;
  Floats flow_x{}, flow_y{};

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.height, self.width, self.flow_x, self.flow_y);
  }
};

/// esim_msgs/FrameInfo
struct FrameInfoMessage {
  Header header{};
  std::int64_t exposure_start_ns = 0, exposure_duration_ns = 0;
  double gain = 1;
  std::uint8_t bits = 8;

  template <typename Self, typename Archive>
  static void fields(Self& self, Archive& archive) {
    archive(self.header, self.exposure_start_ns, self.exposure_duration_ns, self.gain, self.bits);
  }
};

}  // namespace esim::inline formats::ros

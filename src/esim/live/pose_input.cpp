#include "esim/live/pose_input.h"

#include <nlohmann/json.hpp>
#include <span>

#include "esim/formats/ros/messages/message_types.h"
#include "esim/formats/ros/messages/messages.h"
#include "esim/formats/ros/messages/sensor_messages.h"
#include "esim/geometry/so3.h"

namespace esim::inline live {
namespace {

namespace ros = formats::ros;
using Json = nlohmann::json;

constexpr const char* kPoseTopic = "/esim/pose";
constexpr const char* kTwistTopic = "/esim/twist";
constexpr double kLargest = 1e6;  // m, m/s, rad/s

/// Throws nlohmann::json::exception if a coordinate is missing.
Eigen::Vector3d vector_in(const Json& object) {
  return {object.at("x").get<double>(), object.at("y").get<double>(), object.at("z").get<double>()};
}

SE3 pose_in(const ClientMessage& message) {
  if (message.encoding == "json") {
    const Json json = Json::parse(message.payload);
    const Json& pose = json.contains("pose") ? json.at("pose") : json;
    const Json& q = pose.at("orientation");
    return ros::checked_pose({Eigen::Quaterniond(q.at("w").get<double>(), q.at("x").get<double>(),
                                                 q.at("y").get<double>(), q.at("z").get<double>()),
                              vector_in(pose.at("position"))});
  }
  ros::PoseMessage stamped;
  ros::MessageReader(ros::Encoding::cdr, std::as_bytes(std::span(message.payload)))(stamped);
  return ros::checked_pose(stamped.pose);
}

ros::TwistMessage twist_in(const ClientMessage& message) {
  ros::TwistMessage twist;
  if (message.encoding == "json") {
    const Json json = Json::parse(message.payload);
    const Json& plain = json.contains("twist") ? json.at("twist") : json;
    twist.linear = vector_in(plain.at("linear")), twist.angular = vector_in(plain.at("angular"));
  } else {
    ros::MessageReader(ros::Encoding::cdr, std::as_bytes(std::span(message.payload)))(twist);
  }
  const bool usable = twist.linear.lpNorm<Eigen::Infinity>() <= kLargest &&
                      twist.angular.lpNorm<Eigen::Infinity>() <= kLargest;  // false for NaN
  if (!usable) throw ros::Malformed("a twist is not finite");
  return twist;
}

}  // namespace

void PoseInput::begin(const SE3& body) {
  const std::lock_guard lock(mutex_);
  body_ = body;
  pose_.reset(), twist_.reset();
}

void PoseInput::take(const ClientMessage& message) {
  const std::lock_guard lock(mutex_);
  try {
    if (message.topic == kPoseTopic) {
      const SE3 pose = pose_in(message);
      const bool near = pose.translation.lpNorm<Eigen::Infinity>() <= kLargest &&
                        (!body_ || (pose.translation - body_->translation).norm() <= max_jump_m_);
      if (!near) throw ros::Malformed("a pose is too far away");
      pose_ = pose, twist_.reset();
    } else if (message.topic == kTwistTopic) {
      const ros::TwistMessage twist = twist_in(message);
      twist_ = {twist.linear, twist.angular}, pose_.reset();
    } else {
      return;
    }
    ++taken_;
  } catch (const ros::Malformed&) {
    ++refused_;
  } catch (const Json::exception&) {
    ++refused_;
  }
}

SE3 PoseInput::next(const SE3& now, double seconds) {
  const std::lock_guard lock(mutex_);
  SE3 next = pose_.value_or(now);
  if (twist_) {
    next.translation = now.translation + now.rotation * (seconds * twist_->linear);
    next.rotation = (now.rotation * so3_exp(seconds * twist_->angular)).normalized();
  }
  body_ = next;
  return next;
}

std::int64_t PoseInput::taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

std::int64_t PoseInput::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

}  // namespace esim::inline live

#include "esim/formats/ros/topics.h"

#include <algorithm>
#include <functional>
#include <tuple>

namespace esim::inline formats::ros {
namespace {

/// "/dvs/events" is the leaf "events" of "/dvs".
struct Path {
  explicit Path(const std::string& topic) {
    const std::string whole = topic.starts_with('/') ? topic : "/" + topic;
    const std::size_t slash = whole.rfind('/');
    parent = whole.substr(0, slash), leaf = whole.substr(slash + 1);
  }
  std::string parent, leaf;
};

bool is_at_or_below(const std::string& path, const std::string& above) {
  return path == above || path.starts_with(above + "/");
}

bool has_depth(const std::string& topic) { return topic.find("depth") != std::string::npos; }

bool has_events(const Channel& channel) {
  return channel.type == MessageType::events || channel.type == MessageType::event_packet;
}

bool is_of_camera(const Channel& channel) {
  return has_events(channel) || channel.type == MessageType::camera_info || channel.type == MessageType::image ||
         channel.type == MessageType::flow;
}

class Assigner {
 public:
  explicit Assigner(const std::vector<Channel>& channels) : channels_(channels), assignments_(channels.size()) {
    for (const Channel& channel : channels) paths_.emplace_back(channel.topic);
  }

  std::vector<std::string> find_cameras();
  void assign_to_cameras();
  void assign_to_body(bool transforms_have_body);
  std::vector<Assignment> assignments() && { return std::move(assignments_); }

 private:
  template <typename Rank>
  void assign_best(Role role, int camera, const Rank& rank);
  int camera_of(const Path& path) const;
  bool has(Role role, int camera) const;

  const std::vector<Channel>& channels_;
  std::vector<Path> paths_;
  std::vector<std::string> cameras_;  // their paths
  std::vector<Assignment> assignments_;
};

std::vector<std::string> Assigner::find_cameras() {
  std::vector<std::string> with_events;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (has_events(channels_[i])) with_events.push_back(paths_[i].parent);
  }
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const std::string& parent = paths_[i].parent;
    const bool is_below_another = std::any_of(with_events.begin(), with_events.end(), [&](const std::string& other) {
      return parent != other && is_at_or_below(parent, other);
    });
    const bool is_camera = std::find(with_events.begin(), with_events.end(), parent) != with_events.end();
    if (!is_of_camera(channels_[i]) || (is_below_another && !is_camera)) continue;
    if (std::find(cameras_.begin(), cameras_.end(), parent) == cameras_.end()) cameras_.push_back(parent);
  }
  std::vector<std::string> names;
  for (const std::string& path : cameras_) names.push_back(path.empty() ? "cam0" : ros_name(path.substr(1)));
  return names;
}

/// The camera with the longest path; -1: no camera.
int Assigner::camera_of(const Path& path) const {
  int best = -1;
  for (int i = 0; i < static_cast<int>(cameras_.size()); ++i) {
    if (!is_at_or_below(path.parent, cameras_[i])) continue;
    if (best < 0 || cameras_[i].size() > cameras_[best].size()) best = i;
  }
  return best;
}

bool Assigner::has(Role role, int camera) const {
  return std::any_of(assignments_.begin(), assignments_.end(), [&](const Assignment& assignment) {
    return assignment.role == role && assignment.camera == camera;
  });
}

/// Gives the role to the channel of lowest rank, to the first one of several; ranks below 0 exclude a channel.
template <typename Rank>
void Assigner::assign_best(Role role, int camera, const Rank& rank) {
  std::size_t best = channels_.size();
  int best_rank = 0;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const int own = channels_[i].type ? rank(channels_[i], paths_[i]) : -1;
    if (own >= 0 && (best == channels_.size() || own < best_rank)) best = i, best_rank = own;
  }
  if (best < channels_.size()) assignments_[best] = {role, camera};
}

void Assigner::assign_to_cameras() {
  for (int camera = 0; camera < static_cast<int>(cameras_.size()); ++camera) {
    const auto assign = [&](Role role, MessageType type, const std::function<int(const Path&)>& rank) {
      assign_best(role, camera, [&](const Channel& channel, const Path& path) {
        return channel.type == type && camera_of(path) == camera ? rank(path) : -1;
      });
    };
    const auto first = [](const Path&) { return 0; };
    const auto named = [](std::string_view leaf) {
      return [leaf](const Path& path) { return path.leaf == leaf ? 0 : -1; };
    };
    const auto is_depth = [](const Path& path) { return has_depth(path.parent + "/" + path.leaf); };
    assign_best(Role::events, camera, [&](const Channel& channel, const Path& path) {
      return has_events(channel) && camera_of(path) == camera ? 0 : -1;
    });
    assign(Role::camera_info, MessageType::camera_info,
           [&](const Path& path) { return path.parent == cameras_[static_cast<std::size_t>(camera)] ? 0 : -1; });
    assign(Role::irradiance, MessageType::image, named(topic::kIrradiance));
    assign(Role::depth, MessageType::image, [&](const Path& path) { return is_depth(path) ? 0 : -1; });
    assign(Role::frame_info, MessageType::frame_info, first);
    const bool has_pictures = has(Role::irradiance, camera) && !has(Role::frame_info, camera);
    assign(Role::frame, MessageType::image, [&](const Path& path) {
      if (path.leaf == topic::kIrradiance || is_depth(path)) return -1;
      if (has_pictures && path.leaf == topic::kFrame) return -1;
      if (path.leaf == "image_corrupted") return 0;
      return path.leaf == topic::kFrame ? 1 : 2;
    });
    assign(Role::flow, MessageType::flow, first);
    assign(Role::truth_pose, MessageType::pose, named(topic::kTruthPose));
  }
}

void Assigner::assign_to_body(bool transforms_have_body) {
  const auto assign = [&](Role role, MessageType type,
                          const std::function<int(const std::string&, const Path&)>& rank) {
    assign_best(role, 0, [&](const Channel& channel, const Path& path) {
      return channel.type == type ? rank(channel.topic, path) : -1;
    });
  };
  const auto only = [](std::string_view topic) {
    return [topic](const std::string& own, const Path&) { return own == topic ? 0 : -1; };
  };
  assign(Role::imu, MessageType::imu, [](const std::string& own, const Path&) {
    if (own == topic::kImuBias) return -1;
    return own == topic::kImu ? 0 : 1;
  });
  assign(Role::imu_bias, MessageType::imu, only(topic::kImuBias));
  if (!transforms_have_body) {
    assign(Role::body_pose, MessageType::pose, [](const std::string&, const Path& path) {
      if (path.leaf == topic::kTruthPose) return -1;
      return path.leaf == topic::kPose ? 0 : 1;
    });
    return;
  }
  assign(Role::body_transform, MessageType::transforms, only(topic::kTransforms));
  assign(Role::body_twist, MessageType::twist, only(topic::kBodyTwist));
  assign(Role::body_accel, MessageType::accel, only(topic::kBodyAccel));
}

}  // namespace

std::string ros_name(std::string_view name) {
  std::string result(name);
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  std::replace_if(
      result.begin(), result.end(), [&](char c) { return !fits(c); }, '_');
  return result;
}

std::string camera_topic(std::string_view camera, std::string_view leaf) {
  return "/" + ros_name(camera) + "/" + std::string(leaf);
}

Assignments assign_roles(const std::vector<Channel>& channels, bool transforms_have_body) {
  Assigner assigner(channels);
  Assignments result;
  result.cameras = assigner.find_cameras();
  assigner.assign_to_cameras();
  assigner.assign_to_body(transforms_have_body);
  result.of_channels = std::move(assigner).assignments();
  return result;
}

}  // namespace esim::inline formats::ros

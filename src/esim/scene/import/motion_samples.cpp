#include "esim/scene/import/motion_samples.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

namespace esim::inline scene {
namespace {

constexpr std::size_t kMaxDepth = 200;
constexpr double kShortestAnimation_s = 1e-3;

// Keys with at most this interval (15 per second, plus rounding) are samples of a smooth motion.
constexpr double kBakedInterval_s = 0.07;
constexpr double kDenseInterval_s = 0.005;
constexpr double kMaxSamples = 20000;

std::array<const Track*, 3> tracks_of(const GraphNode& node) {
  return {&node.translation_track, &node.rotation_track, &node.scale_track};
}

/// The number of morph targets of the node's meshes.
std::size_t target_count(const SceneGraph& graph, const GraphNode& node) {
  const bool any = !node.meshes.empty() && node.meshes.front() < graph.shapes.size();
  return any ? graph.shapes[node.meshes.front()].targets.size() : 0;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& A) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

/// The times of the keys of the nodes' tracks; empty if these are not dense samples of a smooth motion.
std::vector<double> baked_times(const NodeTransforms& transforms, const std::vector<std::size_t>& nodes) {
  constexpr double kSame_s = 1e-4;
  std::vector<double> keys;
  for (const std::size_t node : nodes) {
    for (const Track* const track : tracks_of(transforms.node(node))) {
      if (!varies(*track)) continue;
      if (track->interpolation != Interpolation::linear) return {};
      keys.insert(keys.end(), track->times_s.begin(), track->times_s.end());
    }
  }
  std::sort(keys.begin(), keys.end());
  std::vector<double> times;
  for (const double t : keys) {
    if (times.empty() || t - times.back() > kSame_s) times.push_back(t);
  }
  if (times.size() < 3 || static_cast<double>(times.size()) > kMaxSamples) return {};
  double shortest = kBakedInterval_s, longest = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    shortest = std::min(shortest, times[i] - times[i - 1]);
    longest = std::max(longest, times[i] - times[i - 1]);
  }
  if (longest > kBakedInterval_s || longest > 3 * shortest) return {};
  // Before its first and after its last key the object rests.
  const auto add = [&](double from, double to) {
    const int count = static_cast<int>(std::ceil((to - from) / longest - 1e-3));
    for (int i = 0; i < count; ++i) times.push_back(from + (to - from) * i / count);
  };
  const double first = times.front(), last = times.back();
  add(transforms.start_s(), first);
  if (transforms.end_s() > last) {
    add(last, transforms.end_s());
    times.erase(std::find(times.rbegin(), times.rend(), last).base() - 1);
    times.push_back(transforms.end_s());
  }
  std::sort(times.begin(), times.end());
  return times;
}

std::vector<double> dense_times(double start_s, double end_s) {
  const double count = std::min(std::ceil((end_s - start_s) / kDenseInterval_s), kMaxSamples);
  std::vector<double> times;
  for (double i = 0; i <= count; ++i) times.push_back(start_s + (end_s - start_s) * i / count);
  return times;
}

}  // namespace

NodeTransforms::NodeTransforms(const SceneGraph& graph, const std::filesystem::path& file) : graph_(graph) {
  std::vector<std::size_t> depth;
  for (const GraphNode& node : graph.nodes) {
    depth.push_back(node.parent >= 0 ? depth[static_cast<std::size_t>(node.parent)] + 1 : 0);
    if (depth.back() > kMaxDepth) fail_scene(file, fmt::format("nests nodes more than {} deep; flatten it", kMaxDepth));
    bool varies_here = false;
    for (const Track* const track : tracks_of(node)) {
      if (!varies(*track)) continue;
      add_keys(track->times_s);
      varies_here = true;
    }
    animated_.push_back(varies_here);
    morphs_.push_back(varies(node.weight_track, target_count(graph, node)));
    if (morphs_.back()) add_keys(node.weight_track.times_s);
  }
  if (end_s_ - start_s_ < kShortestAnimation_s) {
    animated_.assign(animated_.size(), false);
    morphs_.assign(morphs_.size(), false);
    start_s_ = end_s_ = 0;
  }
}

void NodeTransforms::add_keys(const std::vector<double>& times_s) {
  start_s_ = any_keys_ ? std::min(start_s_, times_s.front()) : times_s.front();
  end_s_ = any_keys_ ? std::max(end_s_, times_s.back()) : times_s.back();
  any_keys_ = true;
}

bool NodeTransforms::moves(std::size_t node) const {
  const std::vector<std::size_t> nodes = chain(node);
  return std::any_of(nodes.begin(), nodes.end(), [&](std::size_t i) { return is_animated(i); });
}

std::vector<std::size_t> NodeTransforms::chain(std::size_t node) const {
  std::vector<std::size_t> nodes;
  for (int i = static_cast<int>(node); i >= 0; i = graph_.nodes[static_cast<std::size_t>(i)].parent)
    nodes.push_back(static_cast<std::size_t>(i));
  return nodes;
}

Eigen::Matrix4d NodeTransforms::world(std::size_t node, double t_s) const {
  Eigen::Matrix4d transform = local_transform(graph_.nodes[node], t_s);
  for (int i = graph_.nodes[node].parent; i >= 0; i = graph_.nodes[static_cast<std::size_t>(i)].parent)
    transform = local_transform(graph_.nodes[static_cast<std::size_t>(i)], t_s) * transform;
  return transform;
}

SampledMotion sample_motion(const NodeTransforms& transforms, std::size_t node, const Eigen::Matrix4d& T_node_frame) {
  constexpr double kRigid = 1e-3;
  const std::vector<std::size_t> chain = transforms.chain(node);
  std::vector<double> times = {transforms.start_s()};
  if (transforms.moves(node)) times = baked_times(transforms, chain);
  if (times.empty()) times = dense_times(transforms.start_s(), transforms.end_s());

  // Rotations are relative to the first one, so that they are continuous for any scale.
  const Eigen::Matrix3d first = (transforms.world(node, times.front()) * T_node_frame).topLeftCorner<3, 3>();
  const Eigen::Matrix3d first_rotation = nearest_rotation(first);
  const bool invertible = std::abs(first.determinant()) > 1e-12;
  const Eigen::Matrix3d from_first = invertible ? Eigen::Matrix3d(first.inverse()) : first_rotation.transpose();

  SampledMotion sampled;
  SceneMotion& motion = sampled.motion;
  for (const double t_s : times) {
    const Eigen::Matrix4d transform = transforms.world(node, t_s) * T_node_frame;
    const Eigen::Matrix3d turned = transform.topLeftCorner<3, 3>() * from_first, rotation = nearest_rotation(turned);
    sampled.rigid = sampled.rigid && (turned - rotation).norm() < kRigid;
    ScenePose pose{to_ns(t_s), {}};
    pose.T_world_object.rotation = Eigen::Quaterniond(Eigen::Matrix3d(rotation * first_rotation)).normalized();
    pose.T_world_object.translation = transform.topRightCorner<3, 1>();
    Eigen::Quaterniond& q = pose.T_world_object.rotation;
    if (!motion.empty() && motion.back().T_world_object.rotation.dot(q) < 0) q.coeffs() *= -1.0;
    motion.push_back(pose);
  }
  return sampled;
}

}  // namespace esim::inline scene

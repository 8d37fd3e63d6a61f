#pragma once

#include <memory>
#include <vector>

#include "esim/scene/deformation/deformation.h"
#include "esim/scene/deformation/joint_motion.h"
#include "esim/scene/deformation/morph_target.h"
#include "esim/scene/deformation/skin_weights.h"

namespace esim::inline scene {

/// Morph targets of a range of a mesh's vertices, with their weights over time.
struct Morph {
  std::size_t first_vertex = 0;  ///< to which the targets' vertex 0 corresponds
  std::vector<std::shared_ptr<const MorphTarget>> targets;
  std::vector<float> weights;  ///< if the track is empty
  WeightTrack track;
};

/// The shape of a mesh before it deforms.
struct RestShape {
  std::vector<Eigen::Vector3f> vertices;  ///< m
  std::vector<Eigen::Vector3f> normals;   ///< empty, or per vertex, of length 1 or 0
};

/// Morph targets, then linear blend skinning (glTF 2.0, sections 3.7.2.2 and 3.7.3): vertex v moves to
///
///   p(t) = sum_j w_j J_j(t) (v + sum_k a_k(t) d_k),
///
/// with the weights w_j and transforms J_j of its joints, and the weights a_k and offsets d_k of the morph targets.
/// Normals are multiplied by the inverse transpose of sum_j w_j J_j, and normalised. Velocities are the analytic
/// derivative; at a key, that of the interval after it. Transforms are computed in double precision, vertices in single
/// precision, with errors of about 1e-6 of their distance from the origin.
class SkinnedDeformation final : public Deformation {
 public:
  /// All indices must be valid, and every vertex must have an influence.
  SkinnedDeformation(RestShape rest, SkinWeights weights, std::vector<Morph> morphs, JointMotion joints, TimeSpan span);

  TimeSpan span() const override { return span_; }
  void evaluate(TimeNs t, DeformedVertices& vertices) const override;

  /// From the boxes of what each joint moves, as far as morph targets may displace it: a vertex lies between where its
  /// joints put it.
  Eigen::AlignedBox3f bounds(TimeNs t) const override;

 private:
  RestShape rest_;
  SkinWeights weights_;
  std::vector<Morph> morphs_;
  JointMotion joints_;
  TimeSpan span_;
  std::vector<Eigen::AlignedBox3f> moved_by_;        // per joint, the rest vertices that it influences
  std::vector<std::vector<Eigen::Vector3f>> reach_;  // per morph and target, the largest offsets along the axes
};

}  // namespace esim::inline scene

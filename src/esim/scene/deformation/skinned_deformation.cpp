#include "esim/scene/deformation/skinned_deformation.h"

#include <cmath>
#include <utility>

namespace esim::inline scene {
namespace {

/// The shape after the morph targets, and its change per second.
struct MorphedShape {
  std::vector<Eigen::Vector3f> vertices, normals, velocities;
};

void add(const MorphTarget& target, std::size_t first, float weight, float slope, MorphedShape& shape) {
  if (weight == 0 && slope == 0) return;
  for (std::size_t i = 0; i < target.vertices.size(); ++i) {
    const std::size_t vertex = first + target.vertices[i];
    shape.vertices[vertex] += weight * target.positions[i];
    shape.velocities[vertex] += slope * target.positions[i];
  }
  if (shape.normals.empty()) return;
  for (std::size_t i = 0; i < target.normals.size(); ++i)
    shape.normals[first + target.vertices[i]] += weight * target.normals[i];
}

/// The weights of a morph's targets, and their change per second.
void weights_at(const Morph& morph, double t_s, std::vector<float>& weights, std::vector<float>& slopes) {
  if (!morph.track.times_s.empty()) return sample_at(morph.track, t_s, morph.targets.size(), weights, slopes);
  weights = morph.weights;
  slopes.assign(weights.size(), 0);
}

void apply(const RestShape& rest, const std::vector<Morph>& morphs, double t_s, MorphedShape& shape) {
  shape.vertices = rest.vertices;
  shape.normals = rest.normals;
  shape.velocities.assign(rest.vertices.size(), Eigen::Vector3f::Zero());
  std::vector<float> weights, slopes;
  for (const Morph& morph : morphs) {
    weights_at(morph, t_s, weights, slopes);
    for (std::size_t i = 0; i < morph.targets.size(); ++i)
      add(*morph.targets[i], morph.first_vertex, weights[i], slopes[i], shape);
  }
}

/// The weighted sum of the transforms of a vertex's joints.
JointMatrix blend(const SkinWeights& weights, std::size_t vertex, const std::vector<JointMatrix>& matrices) {
  const std::size_t begin = weights.begin_of(vertex), end = weights.ends[vertex];
  if (end == begin + 1) return matrices[weights.influences[begin].joint];
  JointMatrix sum;
  for (std::size_t i = begin; i < end; ++i) {
    const auto [joint, weight] = weights.influences[i];
    const float* const columns = matrices[joint].columns;
    for (std::size_t k = 0; k < JointMatrix::kSize; ++k) sum.columns[k] += weight * columns[k];
  }
  return sum;
}

/// The product of a matrix, from its columns, and a vector.
Eigen::Vector4f times(const float* columns, const Eigen::Vector3f& vector) {
  const auto column = [&](Eigen::Index i) { return Eigen::Map<const Eigen::Vector4f>(columns + 4 * i); };
  return column(0) * vector[0] + column(1) * vector[1] + column(2) * vector[2];
}

/// The normal of a surface after a transform: by the cofactors of its matrix A, which are det(A) times the inverse
/// transpose, and exist also if A is singular.
Eigen::Vector3f turned(const float* columns, const Eigen::Vector3f& normal) {
  const auto column = [&](Eigen::Index i) { return Eigen::Map<const Eigen::Vector3f>(columns + 4 * i); };
  const Eigen::Vector3f yz = column(1).cross(column(2));
  Eigen::Vector3f result =
      yz * normal[0] + column(2).cross(column(0)) * normal[1] + column(0).cross(column(1)) * normal[2];
  if (column(0).dot(yz) < 0) result = -result;
  const float squared = result.squaredNorm();
  constexpr float kShortest2 = 1e-36F;
  if (!(squared > kShortest2) || !std::isfinite(squared)) return Eigen::Vector3f::Zero();
  return result * (1.0F / std::sqrt(squared));
}

}  // namespace

SkinnedDeformation::SkinnedDeformation(RestShape rest, SkinWeights weights, std::vector<Morph> morphs,
                                       JointMotion joints, TimeSpan span)
    : rest_(std::move(rest)),
      weights_(std::move(weights)),
      morphs_(std::move(morphs)),
      joints_(std::move(joints)),
      span_(span),
      moved_by_(joints_.size()) {
  for (std::size_t vertex = 0; vertex < rest_.vertices.size(); ++vertex) {
    for (std::size_t i = weights_.begin_of(vertex); i < weights_.ends[vertex]; ++i)
      moved_by_[weights_.influences[i].joint].extend(rest_.vertices[vertex]);
  }
  for (const Morph& morph : morphs_) {
    std::vector<Eigen::Vector3f>& of_targets = reach_.emplace_back();
    for (const auto& target : morph.targets) {
      Eigen::Vector3f& reach = of_targets.emplace_back(Eigen::Vector3f::Zero());
      for (const Eigen::Vector3f& offset : target->positions) reach = reach.cwiseMax(offset.cwiseAbs());
    }
  }
}

Eigen::AlignedBox3f SkinnedDeformation::bounds(TimeNs t) const {
  thread_local std::vector<JointMatrix> matrices;
  thread_local std::vector<float> weights, slopes;
  joints_.evaluate(to_seconds(t), matrices);
  Eigen::Vector3f displaced = Eigen::Vector3f::Zero();
  for (std::size_t m = 0; m < morphs_.size(); ++m) {
    weights_at(morphs_[m], to_seconds(t), weights, slopes);
    Eigen::Vector3f of_morph = Eigen::Vector3f::Zero();
    for (std::size_t k = 0; k < reach_[m].size(); ++k) of_morph += std::fabs(weights[k]) * reach_[m][k];
    displaced = displaced.cwiseMax(of_morph);  // morphs have vertices of their own
  }
  Eigen::AlignedBox3f box;
  for (std::size_t joint = 0; joint < moved_by_.size(); ++joint) {
    if (moved_by_[joint].isEmpty()) continue;
    const float* const columns = matrices[joint].columns;
    const Eigen::Map<const Eigen::Matrix<float, 4, 3>> linear(columns);
    const Eigen::Vector3f middle =
        (times(columns, moved_by_[joint].center()) + Eigen::Map<const Eigen::Vector4f>(columns + 12)).head<3>();
    const Eigen::Vector3f half = 0.5F * moved_by_[joint].sizes() + displaced;
    const Eigen::Vector3f reach = linear.topRows<3>().cwiseAbs() * half;
    box.extend(middle - reach), box.extend(middle + reach);
  }
  constexpr float kRounding = 1e-5F;  // of single precision
  const Eigen::Vector3f margin = kRounding * (box.min().cwiseAbs() + box.max().cwiseAbs());
  return {box.min() - margin, box.max() + margin};
}

void SkinnedDeformation::evaluate(TimeNs t, DeformedVertices& vertices) const {
  // Memory that a thread keeps, since new pages cost more than the arithmetic.
  thread_local MorphedShape morphed;
  thread_local std::vector<JointMatrix> matrices;
  const double t_s = to_seconds(t);
  joints_.evaluate(t_s, matrices);
  const bool morphs = !morphs_.empty();
  if (morphs) apply(rest_, morphs_, t_s, morphed);
  const std::vector<Eigen::Vector3f>& positions = morphs ? morphed.vertices : rest_.vertices;
  const std::vector<Eigen::Vector3f>& normals = morphs ? morphed.normals : rest_.normals;
  vertices.positions.resize(positions.size());
  vertices.velocities.resize(positions.size());
  vertices.normals.resize(normals.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const JointMatrix blended = blend(weights_, i, matrices);
    const float *const columns = blended.columns, *const slope = columns + JointMatrix::kSize / 2;
    const Eigen::Map<const Eigen::Vector4f> translation(columns + 12), drift(slope + 12);
    vertices.positions[i] = (times(columns, positions[i]) + translation).head<3>();
    Eigen::Vector4f velocity = times(slope, positions[i]) + drift;
    if (morphs) velocity += times(columns, morphed.velocities[i]);
    vertices.velocities[i] = velocity.head<3>();
    if (!normals.empty()) vertices.normals[i] = turned(columns, normals[i]);
  }
}

}  // namespace esim::inline scene

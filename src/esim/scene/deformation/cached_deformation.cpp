#include "esim/scene/deformation/cached_deformation.h"

#include <utility>

namespace esim::inline scene {

CachedDeformation::CachedDeformation(VertexSpline spline, std::vector<std::uint32_t> numbers, ShadingNormals normals)
    : spline_(std::move(spline)), numbers_(std::move(numbers)), normals_(std::move(normals)), boxes_(spline_.size()) {
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    const Eigen::Vector3f* const points = spline_.control_points(i);
    for (const std::uint32_t number : numbers_) boxes_[i].extend(points[number]);
  }
}

TimeSpan CachedDeformation::span() const { return {to_ns(spline_.start_s()), to_ns(spline_.end_s())}; }

void CachedDeformation::evaluate(TimeNs t, DeformedVertices& vertices) const {
  const VertexSpline::Place place = spline_.place_at(to_seconds(t));
  const bool rests = t < span().start || t >= span().end;
  vertices.positions.resize(numbers_.size());
  vertices.velocities.assign(numbers_.size(), Eigen::Vector3f::Zero());
  const Eigen::Vector3f* const points = spline_.control_points(place.first);
  for (std::size_t i = 0; i < numbers_.size(); ++i) {
    const Eigen::Vector3f* point = points + numbers_[i];
    Eigen::Vector3f position = *point, velocity = Eigen::Vector3f::Zero();
    for (std::size_t k = 0; k < spline_.degree(); ++k, point += spline_.vertices()) {
      const Eigen::Vector3f difference = point[spline_.vertices()] - *point;
      position += place.steps[k] * difference;
      velocity += place.slopes[k] * difference;
    }
    vertices.positions[i] = position;
    if (!rests) vertices.velocities[i] = velocity;
  }
  normals_.evaluate(vertices.positions, vertices.normals);
}

Eigen::AlignedBox3f CachedDeformation::bounds(TimeNs t) const {
  const std::size_t first = spline_.place_at(to_seconds(t)).first;
  Eigen::AlignedBox3f box;
  for (std::size_t i = 0; i <= spline_.degree(); ++i) box.extend(boxes_[first + i]);
  // evaluate() rounds about 20 times by 6e-8 of numbers of at most twice the largest coordinate.
  constexpr float kRounding = 4e-6F;
  const Eigen::Vector3f margin = kRounding * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs());
  return {box.min() - margin, box.max() + margin};
}

}  // namespace esim::inline scene

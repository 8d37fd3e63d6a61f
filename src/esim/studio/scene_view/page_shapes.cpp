#include "esim/studio/scene_view/page_shapes.h"

#include <Eigen/Geometry>
#include <cmath>

namespace esim::studio {
namespace {

constexpr float kSteps = 65535, kNormalSteps = 127;
constexpr std::int64_t kSecond = 1'000'000'000;

template <typename T>
void append(const T& value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_shape(const DeformedVertices& shape, std::string& bytes) {
  Eigen::AlignedBox3f box(Eigen::Vector3f::Zero());
  if (!shape.positions.empty()) box.setEmpty();
  for (const Eigen::Vector3f& position : shape.positions) box.extend(position);
  const Eigen::Vector3f step = box.sizes() / kSteps;
  for (int axis = 0; axis < 3; ++axis) append(box.min()[axis], bytes);
  for (int axis = 0; axis < 3; ++axis) append(step[axis], bytes);
  for (std::size_t i = 0; i < shape.positions.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const float steps = step[axis] > 0 ? (shape.positions[i][axis] - box.min()[axis]) / step[axis] : 0;
      append(static_cast<std::uint16_t>(std::lround(std::min(steps, kSteps))), bytes);
    }
    const Eigen::Vector2f normal =
        octahedral(i < shape.normals.size() ? shape.normals[i] : Eigen::Vector3f(Eigen::Vector3f::Zero()));
    for (int axis = 0; axis < 2; ++axis)
      append(static_cast<std::int8_t>(std::lround(kNormalSteps * normal[axis])), bytes);
  }
}

}  // namespace

TimeNs time_of_shape(std::int64_t number) { return number * kSecond / kShapesPerSecond; }

std::string page_shapes(const Deformation& deformation, std::int64_t first, std::size_t count) {
  std::string bytes;
  DeformedVertices shape;
  for (std::size_t i = 0; i < count; ++i) {
    deformation.evaluate(time_of_shape(first + static_cast<std::int64_t>(i)), shape);
    append_shape(shape, bytes);
  }
  return bytes;
}

Eigen::Vector2f octahedral(const Eigen::Vector3f& direction) {
  const float length = direction.lpNorm<1>();
  if (!(length > 0)) return Eigen::Vector2f::Zero();
  const Eigen::Vector3f n = direction / length;
  if (n.z() >= 0) return n.head<2>();
  return {std::copysign(1 - std::abs(n.y()), n.x()), std::copysign(1 - std::abs(n.x()), n.y())};
}

}  // namespace esim::studio

#include "esim/reproject/parts.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline reproject {
namespace {

using Triangle = PlacedTriangles::Triangle;

Triangle placed(std::uint16_t part, const std::array<Eigen::Vector3d, 3>& corners) {
  constexpr double kLine = 1e-4;  // sine of an angle
  Triangle triangle{part, false, corners[0], {}, {}};
  triangle.sides.col(0) = corners[1] - corners[0], triangle.sides.col(1) = corners[2] - corners[0];
  const Eigen::Vector3d normal = triangle.sides.col(0).cross(triangle.sides.col(1));
  const double area = normal.norm();
  triangle.is_line = !(area > kLine * triangle.sides.col(0).norm() * triangle.sides.col(1).norm());
  if (triangle.is_line) return triangle;
  triangle.sides.col(2) = normal / area;
  triangle.inverse = triangle.sides.inverse();
  return triangle;
}

/// The map from one time to another. A triangle that is nearly a line only moves, by `rigid` and by what its first
/// corner moves in addition.
ViewChange change_of(const Triangle& from, const Triangle& to, const ViewChange& rigid) {
  const Eigen::Matrix3d map =
      from.is_line || to.is_line ? Eigen::Matrix3d(rigid.R.cast<double>()) : Eigen::Matrix3d(to.sides * from.inverse);
  return {map.cast<float>(), (to.corner - map * from.corner).cast<float>()};
}

}  // namespace

std::vector<ViewChange> view_changes(const RenderRequest& from, const RenderRequest& to) {
  const SE3 T_to_world = to.camera.T_world_body.inverse();
  std::vector<ViewChange> changes;
  const auto add = [&](const SE3& T_to_from) {
    changes.push_back({T_to_from.rotation.toRotationMatrix().cast<float>(), T_to_from.translation.cast<float>()});
  };
  add(T_to_world * from.camera.T_world_body);
  for (std::size_t i = 0; i < from.objects.size(); ++i) {
    const SE3 T_then_now = to.objects[i].T_world_body * from.objects[i].T_world_body.inverse();
    add(T_to_world * T_then_now * from.camera.T_world_body);
  }
  return changes;
}

SceneParts::SceneParts(std::shared_ptr<const DeformingSurfaces> surfaces, std::size_t objects)
    : surfaces_(std::move(surfaces)) {
  if (surfaces_ == nullptr) return;
  constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();
  count_ = objects + 1;
  for (std::size_t object = 1; object <= objects; ++object) {
    const std::size_t triangles = surfaces_->triangle_count(object);
    if (triangles == 0) continue;
    deforming_.push_back({object, count_, triangles});
    count_ += triangles;
  }
  if (count_ > kMost) {
    throw UserError("sampling: type keyframes supports at most " + std::to_string(kMost) +
                    " triangles that deform, but the scene has " + std::to_string(count_ - objects - 1) +
                    "; use type adaptive, or fewer or simpler figures");
  }
}

Image<std::uint16_t> SceneParts::seen(const Sample& sample) const {
  Image<std::uint16_t> parts = sample.object;
  if (parts.empty() || sample.surface.empty()) return parts;
  for (const Triangles& triangles : deforming_) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (sample.object.pixels()[i] == triangles.object)
        parts.pixels()[i] = static_cast<std::uint16_t>(triangles.first + sample.surface.pixels()[i].triangle);
    }
  }
  return parts;
}

std::vector<std::uint16_t> SceneParts::deforming(std::span<const std::uint16_t> parts) const {
  std::vector<std::uint16_t> found;
  if (deforming_.empty()) return found;
  for (const std::uint16_t part : parts) {
    if (part >= deforming_.front().first) found.push_back(part);
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

PlacedTriangles SceneParts::place(const RenderRequest& view, const std::vector<std::uint16_t>& wanted) const {
  PlacedTriangles result{view, {}};
  result.triangles.reserve(wanted.size());
  for (const Triangles& of : deforming_) {
    const auto begin = std::lower_bound(wanted.begin(), wanted.end(), of.first);
    const auto end = std::lower_bound(begin, wanted.end(), of.first + of.count);
    std::vector<SurfacePoint> corners;
    for (auto part = begin; part != end; ++part) {
      const auto triangle = static_cast<std::uint32_t>(*part - of.first);
      corners.insert(corners.end(), {{triangle, 0, 0}, {triangle, 1, 0}, {triangle, 0, 1}});
    }
    if (corners.empty()) continue;
    std::vector<Eigen::Vector3f> positions(corners.size());
    surfaces_->locate(of.object, view.t, corners, positions);
    const SE3 T_camera_object = view.camera.T_world_body.inverse() * view.objects[of.object - 1].T_world_body;
    const Eigen::Matrix3d R = T_camera_object.rotation.toRotationMatrix();
    const auto in_camera = [&](const Eigen::Vector3f& at) {
      return Eigen::Vector3d(R * at.cast<double>() + T_camera_object.translation);
    };
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      result.triangles.push_back(
          placed(begin[static_cast<std::ptrdiff_t>(i / 3)],
                 {in_camera(positions[i]), in_camera(positions[i + 1]), in_camera(positions[i + 2])}));
    }
  }
  return result;
}

std::size_t SceneParts::object_of(std::uint16_t part) const {
  auto of = deforming_.begin();
  while (of->first + of->count <= part) ++of;
  return of->object;
}

std::vector<ViewChange> SceneParts::changes(const PlacedTriangles& from, const PlacedTriangles& to) const {
  std::vector<ViewChange> changes = view_changes(from.view, to.view);
  if (from.triangles.empty()) return changes;
  changes.resize(count_);
  for (std::size_t i = 0; i < from.triangles.size(); ++i) {
    const std::uint16_t part = from.triangles[i].part;
    changes[part] = change_of(from.triangles[i], to.triangles[i], changes[object_of(part)]);
  }
  return changes;
}

}  // namespace esim::inline reproject

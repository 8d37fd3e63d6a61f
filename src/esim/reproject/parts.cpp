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

using Corners = std::array<Eigen::Vector3d, 3>;

/// The map of a triangle's corners and its unit normal, both in the camera frame. A triangle that is nearly a line only
/// moves, by `rigid` and by what its first corner moves in addition.
ViewChange change_of(const Corners& from, const Corners& to, const ViewChange& rigid) {
  constexpr double kFlat = 1e-4;  // sine of an angle
  const auto frame = [&](const Corners& at, Eigen::Matrix3d& sides) {
    sides.col(0) = at[1] - at[0], sides.col(1) = at[2] - at[0];
    const Eigen::Vector3d normal = sides.col(0).cross(sides.col(1));
    const double area = normal.norm();
    sides.col(2) = normal / area;
    return area > kFlat * sides.col(0).norm() * sides.col(1).norm();
  };
  Eigen::Matrix3d sides, sides_there, map;
  if (frame(from, sides) && frame(to, sides_there)) {
    map = sides_there * sides.inverse();
  } else {
    map = rigid.R.cast<double>();
  }
  return {map.cast<float>(), (to[0] - map * from[0]).cast<float>()};
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

std::vector<ViewChange> SceneParts::changes(const RenderRequest& from, const RenderRequest& to,
                                            const std::vector<std::uint16_t>& wanted) const {
  std::vector<ViewChange> changes = view_changes(from, to);
  if (wanted.empty()) return changes;
  changes.resize(count_);
  for (const Triangles& triangles : deforming_) change_triangles(triangles, from, to, wanted, changes);
  return changes;
}

void SceneParts::change_triangles(const Triangles& triangles, const RenderRequest& from, const RenderRequest& to,
                                  const std::vector<std::uint16_t>& wanted, std::vector<ViewChange>& changes) const {
  const auto begin = std::lower_bound(wanted.begin(), wanted.end(), triangles.first);
  const auto end = std::lower_bound(begin, wanted.end(), triangles.first + triangles.count);
  if (begin == end) return;
  std::vector<SurfacePoint> corners;
  for (auto part = begin; part != end; ++part) {
    const auto triangle = static_cast<std::uint32_t>(*part - triangles.first);
    corners.insert(corners.end(), {{triangle, 0, 0}, {triangle, 1, 0}, {triangle, 0, 1}});
  }
  std::vector<Eigen::Vector3f> before(corners.size()), after(corners.size());
  surfaces_->locate(triangles.object, from.t, corners, before);
  surfaces_->locate(triangles.object, to.t, corners, after);

  const auto in_camera = [&](const RenderRequest& view) {
    return view.camera.T_world_body.inverse() * view.objects[triangles.object - 1].T_world_body;
  };
  const SE3 T_from_object = in_camera(from), T_to_object = in_camera(to);
  const ViewChange rigid = changes[triangles.object];
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    Corners here, there;
    for (std::size_t k = 0; k < 3; ++k) {
      here[k] = T_from_object * before[i + k].cast<double>();
      there[k] = T_to_object * after[i + k].cast<double>();
    }
    changes[begin[static_cast<std::ptrdiff_t>(i / 3)]] = change_of(here, there, rigid);
  }
}

}  // namespace esim::inline reproject

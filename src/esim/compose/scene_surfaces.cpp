#include "esim/compose/scene_surfaces.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

namespace esim::inline compose {
namespace {

/// The shapes of an object at the last few times: keyframes are asked for again and again.
class RecentShapes {
 public:
  explicit RecentShapes(std::shared_ptr<const Deformation> deformation) : deformation_(std::move(deformation)) {}

  std::shared_ptr<const DeformedVertices> at(TimeNs t) {
    {
      const std::lock_guard lock(mutex_);
      const auto known = std::find_if(shapes_.begin(), shapes_.end(), [t](const Shape& shape) { return shape.t == t; });
      if (known != shapes_.end() && known->vertices != nullptr) return known->vertices;
    }
    auto vertices = std::make_shared<DeformedVertices>();
    deformation_->evaluate(t, *vertices);
    const std::lock_guard lock(mutex_);
    shapes_[next_++ % shapes_.size()] = {t, vertices};
    return vertices;
  }

 private:
  struct Shape {
    TimeNs t = 0;
    std::shared_ptr<const DeformedVertices> vertices;
  };
  std::shared_ptr<const Deformation> deformation_;
  std::mutex mutex_;
  std::array<Shape, 4> shapes_;
  std::size_t next_ = 0;
};

class SceneSurfaces final : public DeformingSurfaces {
 public:
  explicit SceneSurfaces(const Scene& scene) {
    for (const SceneObject& object : scene.objects) {
      if (!object.moves) continue;
      objects_.emplace_back();
      if (object.deformation == nullptr) continue;
      objects_.back() = {std::make_unique<RecentShapes>(object.deformation), object.mesh.triangles};
    }
  }

  bool any() const {
    return std::any_of(objects_.begin(), objects_.end(), [](const Object& object) { return object.shapes != nullptr; });
  }

  std::size_t triangle_count(std::size_t object) const override { return objects_[object - 1].triangles.size(); }

  void locate(std::size_t object, TimeNs t, std::span<const SurfacePoint> points,
              std::span<Eigen::Vector3f> positions) const override {
    const auto& [shapes, triangles] = objects_[object - 1];
    const std::shared_ptr<const DeformedVertices> vertices = shapes->at(t);
    for (std::size_t i = 0; i < points.size(); ++i)
      positions[i] = at_point(vertices->positions, triangles[points[i].triangle], points[i]);
  }

 private:
  struct Object {
    std::unique_ptr<RecentShapes> shapes;  // null if it is rigid
    std::vector<std::array<std::uint32_t, 3>> triangles;
  };
  std::vector<Object> objects_;
};

}  // namespace

std::shared_ptr<const DeformingSurfaces> deforming_surfaces(const Scene& scene) {
  auto surfaces = std::make_shared<const SceneSurfaces>(scene);
  return surfaces->any() ? std::shared_ptr<const DeformingSurfaces>(std::move(surfaces)) : nullptr;
}

}  // namespace esim::inline compose

#include "esim/compose/scene_surfaces.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace esim::inline compose {
namespace {

class SceneSurfaces final : public DeformingSurfaces {
 public:
  explicit SceneSurfaces(const Scene& scene) {
    for (const SceneObject& object : scene.objects) {
      if (!object.moves) continue;
      const bool deforms = object.deformation != nullptr;
      objects_.push_back({object.deformation, deforms ? object.mesh.triangles : std::vector<Triangle>{}});
    }
  }

  bool any() const {
    return std::ranges::any_of(objects_, [](const auto& object) { return object.deformation; });
  }

  std::size_t triangle_count(std::size_t object) const override { return objects_[object - 1].triangles.size(); }

  void locate(std::size_t object, TimeNs t, std::span<const SurfacePoint> points,
              std::span<Eigen::Vector3f> positions) const override {
    const auto& [deformation, triangles] = objects_[object - 1];
    DeformedVertices vertices;
    deformation->evaluate(t, vertices);
    const std::vector<Eigen::Vector3f>& at = vertices.positions;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [a, b, c] = triangles[points[i].triangle];
      positions[i] = at[a] + points[i].b1 * (at[b] - at[a]) + points[i].b2 * (at[c] - at[a]);
    }
  }

 private:
  using Triangle = std::array<std::uint32_t, 3>;
  struct Object {
    std::shared_ptr<const Deformation> deformation;  // null if it is rigid
    std::vector<Triangle> triangles;
  };
  std::vector<Object> objects_;
};

}  // namespace

std::shared_ptr<const DeformingSurfaces> deforming_surfaces(const Scene& scene) {
  auto surfaces = std::make_shared<const SceneSurfaces>(scene);
  return surfaces->any() ? std::shared_ptr<const DeformingSurfaces>(std::move(surfaces)) : nullptr;
}

}  // namespace esim::inline compose

#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "esim/backends/raycast/ray_blocks.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/backends/raycast/triangles/deforming_group.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// A group of triangles, as a camera sees it at one time.
struct PlacedGroup {
  const GroupTriangles* rigid;              // in the group's frame; null if it deforms
  std::unique_ptr<DeformsLater> deforming;  // null if it is rigid
  Eigen::Matrix3f R_group_camera, R_camera_group;
  Eigen::Vector3f camera;        // position of the camera in the group's frame
  BearingBounds bounds;          // contain the visible part of the group
  Eigen::AlignedBox3f box;       // contains the group, in its frame
  std::uint32_t first_triangle;  // index in the scene

  /// Its triangles, which are computed if it deforms.
  const GroupTriangles& triangles() const { return rigid != nullptr ? *rigid : deforming->get().triangles; }
};

/// The groups of a scene at one time, and the data of their triangles.
struct PlacedGroups {
  std::vector<PlacedGroup> groups;
  std::shared_ptr<SceneTriangles> triangles;
};

/// What a scene is prepared for.
enum class SceneUse {
  rays,     ///< rays of the camera and of shadows
  surfaces  ///< projecting its triangles, and rays of shadows
};

/// The triangles of a scene in groups: group 0 is static, group i + 1 is the i-th moving object. Immutable, so that any
/// number of threads can use it for any times of the scene.
class RaycastScene {
 public:
  explicit RaycastScene(const Scene& scene, SceneUse use = SceneUse::rays);

  /// Calls f with the number of rays in a packet that suits this processor, as a std::integral_constant.
  template <class F>
  void with_packet_size(const F& f) const {
    if (packet_size_ == 16) return f(std::integral_constant<int, 16>());
    if (packet_size_ == 8) return f(std::integral_constant<int, 8>());
    f(std::integral_constant<int, 4>());
  }

  /// The groups as a camera sees them. Throws InternalError if the request has another number of moving objects.
  PlacedGroups place(const RenderRequest& request) const;

  /// Whether any object deforms.
  bool deforms() const { return deforms_; }

  /// Index of the first triangle of a group.
  std::uint32_t first_triangle(unsigned group) const { return groups_[group].first_triangle; }
  const Material& material(unsigned index) const { return materials_[index]; }

  /// Whether there are materials in each colour: then index + first_material(colour) is the material of a colour that
  /// corresponds to index.
  bool has_colours() const { return material_count_ < materials_.size(); }
  std::uint32_t first_material(std::size_t colour) const {
    return static_cast<std::uint32_t>((1 + colour) * material_count_);
  }

  /// The view of an environment to which a first material belongs: 0 for luminance, 1 + colour.
  std::uint8_t view(std::uint32_t first_material) const {
    return static_cast<std::uint8_t>(first_material / material_count_);
  }

  const std::optional<Lighting>& lighting() const { return lighting_; }

 private:
  struct Group {
    std::uint32_t first_triangle;
    GroupTriangles rigid;
    std::unique_ptr<DeformingGroup> deforming;  // null if it is rigid
    Eigen::AlignedBox3f bounds;                 // of the vertices of a rigid group
  };

  TriangleUse triangle_use(SceneUse use) const;
  void add_group(const std::vector<const Mesh*>& meshes);
  void add_deforming(const SceneObject& object);
  void append_materials(const Mesh& mesh);
  void append_colours(const std::vector<const Mesh*>& meshes);
  std::uint32_t append_triangles(const std::vector<const Mesh*>& meshes);

  DevicePointer device_;
  std::optional<Lighting> lighting_;
  TriangleUse use_{};
  int packet_size_ = 4;
  std::vector<Material> materials_;  // in luminance, then in each colour, if there are any
  std::size_t material_count_ = 0;   // of luminance
  std::vector<Group> groups_;
  std::vector<std::vector<TriangleShading>> shading_;  // of each rigid group
  std::vector<std::vector<CornerNormals>> normals_;    // likewise, up to the last triangle that light needs
  std::shared_ptr<SceneTriangles> triangles_ = std::make_shared<SceneTriangles>();
  bool deforms_ = false;
};

}  // namespace esim::inline backends::inline raycast

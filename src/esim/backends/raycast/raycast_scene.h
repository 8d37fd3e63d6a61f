#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "esim/backends/raycast/embree.h"
#include "esim/backends/raycast/ray_blocks.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/backends/raycast/triangle_tree.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// A triangle's data for shading, in one cache line. Texture coordinates are uv0 + b1 uv1 + b2 uv2 (barycentric b), and
/// have the gradients (gradient_u, gradient_v) per metre in its plane.
struct alignas(64) TriangleShading {
  float u0, v0, u1, v1, u2, v2;
  float gradient_u[3], gradient_v[3];
  std::uint32_t material;
};

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DevicePointer = std::unique_ptr<RTCDeviceTy, ReleaseDevice>;
using ScenePointer = std::unique_ptr<RTCSceneTy, ReleaseScene>;

/// A rigid group of triangles, as a camera sees it at one time.
struct PlacedGroup {
  RTCScene triangles;        // in the group's frame, for rays; null without triangles
  const TriangleTree* tree;  // of the same triangles
  Eigen::Matrix3f R_group_camera, R_camera_group;
  Eigen::Vector3f camera;        // position of the camera in the group's frame
  BearingBounds bounds;          // contain the visible part of the group
  std::uint32_t first_triangle;  // index in the scene
};

/// What a scene is prepared for.
enum class SceneUse {
  rays,     ///< rays of the camera and of shadows
  surfaces  ///< projecting its triangles, and rays of shadows
};

/// The triangles of a scene in rigid groups: group 0 is static, group i + 1 is the i-th moving object. Immutable, so
/// that any number of threads can use it for any times of the scene.
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
  std::vector<PlacedGroup> place(const RenderRequest& request) const;

  /// Index of the first triangle of a group.
  std::uint32_t first_triangle(unsigned group) const { return groups_[group].first_triangle; }
  const TriangleShading& triangle(std::uint32_t index) const { return triangles_[index]; }
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

  /// The normals at a triangle's corners; null or of length 0 if it is flat.
  const std::array<Eigen::Vector3f, 3>* corner_normals(std::uint32_t index) const {
    return index < corner_normals_.size() ? &corner_normals_[index] : nullptr;
  }

 private:
  struct Group {
    std::uint32_t first_triangle;
    ScenePointer accelerator;    // null without triangles, or if no ray is needed
    TriangleTree tree;           // empty for rays if there are many triangles
    Eigen::AlignedBox3f bounds;  // of its vertices
  };

  void add_group(const std::vector<const Mesh*>& meshes);
  void build_trees(const std::vector<const Mesh*>& meshes, Group& group) const;
  void append(const Mesh& mesh);
  void append_colours(const std::vector<const Mesh*>& meshes);

  SceneUse use_;
  DevicePointer device_;
  int packet_size_ = 4;
  std::optional<Lighting> lighting_;
  std::vector<Material> materials_;  // in luminance, then in each colour, if there are any
  std::size_t material_count_ = 0;   // of luminance
  std::vector<Group> groups_;
  std::vector<TriangleShading> triangles_;                      // of all groups
  std::vector<std::array<Eigen::Vector3f, 3>> corner_normals_;  // likewise, up to the last one that light needs
};

}  // namespace esim::inline backends::inline raycast

#include "esim/backends/raycast/raycast_scene.h"

#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "esim/core/error.h"

namespace esim::inline backends::inline raycast {
namespace {

TriangleShading shading_of(const Mesh& mesh, std::size_t index, std::uint32_t first_material) {
  const auto& [uv0, uv1, uv2] = mesh.texture_uv[index];
  TriangleShading shading{};
  shading.u0 = uv0.x(), shading.v0 = uv0.y();
  shading.u1 = uv1.x() - uv0.x(), shading.v1 = uv1.y() - uv0.y();
  shading.u2 = uv2.x() - uv0.x(), shading.v2 = uv2.y() - uv0.y();
  shading.material = first_material + mesh.material[index];

  // The plane's dual basis gives barycentric coordinates per metre; a degenerate triangle is never hit.
  const auto& corner = mesh.triangles[index];
  const Eigen::Vector3d e1 = (mesh.vertices[corner[1]] - mesh.vertices[corner[0]]).cast<double>();
  const Eigen::Vector3d e2 = (mesh.vertices[corner[2]] - mesh.vertices[corner[0]]).cast<double>();
  const Eigen::Vector3d normal = e1.cross(e2);
  const double area2 = normal.squaredNorm();
  if (area2 > 0) {
    const Eigen::Vector3d dual1 = e2.cross(normal) / area2, dual2 = normal.cross(e1) / area2;
    Eigen::Map<Eigen::Vector3f>(shading.gradient_u) = (shading.u1 * dual1 + shading.u2 * dual2).cast<float>();
    Eigen::Map<Eigen::Vector3f>(shading.gradient_v) = (shading.v1 * dual1 + shading.v2 * dual2).cast<float>();
  }
  return shading;
}

// With more triangles, most parts of an image see too many of them.
constexpr std::size_t kMaxInTree = 20'000;

void throw_on_error(RTCDevice device, const char* what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw UserError(std::string("mesh: Embree cannot ") + what +
                  (error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory; use a mesh with fewer triangles"
                                                    : ": error code " + std::to_string(error)));
}

void attach(RTCDevice device, RTCScene scene, const Mesh& mesh) {
  // Embree requires padded buffers: it allocates them, and the data are copied.
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), mesh.vertices.size());
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(mesh.triangles[0]), mesh.triangles.size());
  throw_on_error(device, "store the mesh");
  std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

/// All meshes as one, so that an index identifies a triangle. Materials remain separate per mesh.
Mesh joined(const std::vector<const Mesh*>& meshes) {
  Mesh all;
  for (const Mesh* mesh : meshes) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh->vertices.begin(), mesh->vertices.end());
    for (const auto& [a, b, c] : mesh->triangles) all.triangles.push_back({first + a, first + b, first + c});
  }
  return all;
}

/// The bearings under which a box may be visible: all of them, unless it is completely in front of the camera.
BearingBounds bounds_in_view(const Eigen::AlignedBox3f& box, const SE3& T_group_camera) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kRounding = 1e-4F;
  BearingBounds bounds{kInfinity, -kInfinity, kInfinity, -kInfinity};
  if (box.isEmpty()) return bounds;
  const SE3 T_camera_group = T_group_camera.inverse();
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3f corner = box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i));
    const Eigen::Vector3f point = (T_camera_group * corner.cast<double>()).cast<float>();
    if (!(point.z() > 0.01F)) return {-kInfinity, kInfinity, -kInfinity, kInfinity};
    const float x = point.x() / point.z(), y = point.y() / point.z();
    bounds.left = std::min(bounds.left, x - kRounding), bounds.right = std::max(bounds.right, x + kRounding);
    bounds.top = std::min(bounds.top, y - kRounding), bounds.bottom = std::max(bounds.bottom, y + kRounding);
  }
  return bounds;
}

}  // namespace

RaycastScene::RaycastScene(const Scene& scene, SceneUse use) : use_(use), lighting_(scene.lighting) {
  device_.reset(rtcNewDevice("hugepages=1"));
  if (device_ == nullptr) throw_on_error(nullptr, "start");
  if (rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) packet_size_ = 8;
  if (rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) packet_size_ = 16;

  std::vector<const Mesh*> still;
  for (const SceneObject& object : scene.objects) {
    if (!object.moves) still.push_back(&object.mesh);
  }
  add_group(still);
  std::vector<const Mesh*> all = still;
  for (const SceneObject& object : scene.objects) {
    if (!object.moves) continue;
    add_group({&object.mesh});
    all.push_back(&object.mesh);
  }
  material_count_ = materials_.size();
  append_colours(all);
}

/// Appends the colours of all meshes, in the order of the meshes; those without colours are grey.
void RaycastScene::append_colours(const std::vector<const Mesh*>& meshes) {
  const auto is_coloured = [](const Mesh* mesh) { return !mesh->coloured[0].empty(); };
  if (std::none_of(meshes.begin(), meshes.end(), is_coloured)) return;
  for (std::size_t colour = 0; colour < 3; ++colour) {
    for (const Mesh* mesh : meshes) {
      const std::vector<Material>& seen = is_coloured(mesh) ? mesh->coloured[colour] : mesh->materials;
      materials_.insert(materials_.end(), seen.begin(), seen.end());
    }
  }
}

void RaycastScene::add_group(const std::vector<const Mesh*>& meshes) {
  Group& group = groups_.emplace_back();
  group.first_triangle = static_cast<std::uint32_t>(triangles_.size());
  for (const Mesh* mesh : meshes) {
    for (const Eigen::Vector3f& vertex : mesh->vertices) group.bounds.extend(vertex);
  }
  build_trees(meshes, group);
  for (const Mesh* mesh : meshes) append(*mesh);  // last: building a tree takes memory of its own
}

/// Prepares the triangles of a group for what the scene is used for.
void RaycastScene::build_trees(const std::vector<const Mesh*>& meshes, Group& group) const {
  const Mesh all = meshes.size() == 1 ? Mesh() : joined(meshes);
  const Mesh& mesh = meshes.size() == 1 ? *meshes[0] : all;
  if (mesh.triangles.empty()) return;
  if (use_ == SceneUse::surfaces || mesh.triangles.size() <= kMaxInTree)
    group.tree = TriangleTree(mesh.vertices, mesh.triangles);
  if (use_ == SceneUse::surfaces && !(lighting_ && lighting_->shadows)) return;
  group.accelerator.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(group.accelerator.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(group.accelerator.get(), RTC_BUILD_QUALITY_HIGH);  // slower to build, faster to query
  attach(device_.get(), group.accelerator.get(), mesh);
  // One thread builds the tree, so that it is the same in every run. (The device's own limit on threads would affect
  // the complete process.)
  tbb::task_arena(1).execute([&group] { rtcJoinCommitScene(group.accelerator.get()); });
  throw_on_error(device_.get(), "build the scene");
}

void RaycastScene::append(const Mesh& mesh) {
  const auto first_material = static_cast<std::uint32_t>(materials_.size());
  materials_.insert(materials_.end(), mesh.materials.begin(), mesh.materials.end());
  const std::size_t first_triangle = triangles_.size();
  triangles_.reserve(first_triangle + mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) triangles_.push_back(shading_of(mesh, i, first_material));

  if (!lighting_ || mesh.normals.empty()) return;
  const Eigen::Vector3f none = Eigen::Vector3f::Zero();
  corner_normals_.resize(first_triangle, {none, none, none});  // of the previous flat triangles
  for (const auto& [a, b, c] : mesh.triangles)
    corner_normals_.push_back({mesh.normals[a], mesh.normals[b], mesh.normals[c]});
}

std::vector<PlacedGroup> RaycastScene::place(const RenderRequest& request) const {
  if (request.objects.size() + 1 != groups_.size()) {
    throw InternalError("a request names " + std::to_string(request.objects.size()) +
                        " moving objects, but the scene has " + std::to_string(groups_.size() - 1));
  }
  std::vector<PlacedGroup> placed;
  for (const Group& group : groups_) {
    const SE3 T_world_group = placed.empty() ? SE3() : request.objects[placed.size() - 1].T_world_body;
    const SE3 T_group_camera = T_world_group.inverse() * request.camera.T_world_body;
    const Eigen::Matrix3f R_group_camera = T_group_camera.rotation.toRotationMatrix().cast<float>();
    placed.push_back({group.accelerator.get(), &group.tree, R_group_camera, R_group_camera.transpose(),
                      T_group_camera.translation.cast<float>(), bounds_in_view(group.bounds, T_group_camera),
                      group.first_triangle});
  }
  return placed;
}

std::shared_ptr<const RaycastScene> build_raycast_scene(const Scene& scene) {
  return std::make_shared<const RaycastScene>(scene);
}

}  // namespace esim::inline backends::inline raycast

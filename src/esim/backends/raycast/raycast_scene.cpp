#include "esim/backends/raycast/raycast_scene.h"

#include <algorithm>
#include <string>

#include "esim/core/error.h"

namespace esim::inline backends::inline raycast {
namespace {

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

RaycastScene::RaycastScene(const Scene& scene, SceneUse use) : lighting_(scene.lighting) {
  device_.reset(rtcNewDevice("hugepages=1"));
  if (device_ == nullptr) throw_on_error(nullptr, "start");
  if (rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) packet_size_ = 8;
  if (rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) packet_size_ = 16;
  use_ = triangle_use(use);

  std::vector<const Mesh*> still;
  for (const SceneObject& object : scene.objects) {
    if (!object.moves) still.push_back(&object.mesh);
  }
  add_group(still);
  std::vector<const Mesh*> all = still;
  for (const SceneObject& object : scene.objects) {
    if (!object.moves) continue;
    all.push_back(&object.mesh);
    if (object.deforms()) {
      add_deforming(object);
    } else {
      add_group({&object.mesh});
    }
  }
  material_count_ = materials_.size();
  append_colours(all);
}

TriangleUse RaycastScene::triangle_use(SceneUse use) const {
  const bool surfaces = use == SceneUse::surfaces;
  return {device_.get(), surfaces, !surfaces || (lighting_ && lighting_->shadows), lighting_.has_value()};
}

void RaycastScene::append_materials(const Mesh& mesh) {
  materials_.insert(materials_.end(), mesh.materials.begin(), mesh.materials.end());
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
  for (const Mesh* mesh : meshes) {
    for (const Eigen::Vector3f& vertex : mesh->vertices) group.bounds.extend(vertex);
  }
  {
    const Mesh all = meshes.size() == 1 ? Mesh() : joined(meshes);
    const Mesh& mesh = meshes.size() == 1 ? *meshes[0] : all;
    const std::size_t count = mesh.triangles.size();
    if (count > 0 && use_.wants_tree(count)) group.rigid.tree = TriangleTree(mesh.vertices, mesh.triangles);
    if (count > 0 && use_.rays) group.rigid.rays = RayTriangles(use_.device, mesh.vertices, mesh.triangles, false);
  }
  group.first_triangle = append_triangles(meshes);  // last: building a tree takes memory of its own
}

/// Appends the data of triangles, and returns the index of the first one.
std::uint32_t RaycastScene::append_triangles(const std::vector<const Mesh*>& meshes) {
  std::size_t count = 0;
  for (const Mesh* mesh : meshes) count += mesh->triangles.size();
  std::vector<TriangleShading>& shading = shading_.emplace_back();
  std::vector<CornerNormals>& normals = normals_.emplace_back();
  shading.reserve(count);
  const Eigen::Vector3f none = Eigen::Vector3f::Zero();
  for (const Mesh* mesh : meshes) {
    const auto first_material = static_cast<std::uint32_t>(materials_.size());
    append_materials(*mesh);
    if (use_.normals && !mesh->normals.empty()) {
      normals.resize(shading.size(), {none, none, none});  // of the previous flat triangles
      for (const auto& [a, b, c] : mesh->triangles)
        normals.push_back({mesh->normals[a], mesh->normals[b], mesh->normals[c]});
    }
    const std::size_t begin = shading.size();
    for (std::size_t i = 0; i < mesh->triangles.size(); ++i) shading.emplace_back(*mesh, i, first_material);
    if (use_.surfaces) connect(*mesh, use_.normals, std::span(shading).subspan(begin));
  }
  // Up to the end of a page; the triangles that follow are flat.
  const std::size_t rest = normals.size() % SceneTriangles::kPage;
  if (rest > 0)
    normals.resize(std::min(shading.size(), normals.size() - rest + SceneTriangles::kPage), {none, none, none});
  if (groups_.size() == 1 && count == 0) shading.emplace_back();  // triangle 0, which rays without a hit have
  const std::uint32_t first = triangles_->add(shading.size());
  triangles_->set(first, shading, normals);
  return first;
}

void RaycastScene::add_deforming(const SceneObject& object) {
  Group& group = groups_.emplace_back();
  const auto first_material = static_cast<std::uint32_t>(materials_.size());
  append_materials(object.mesh);
  group.deforming = std::make_unique<DeformingGroup>(object, use_, first_material);
  group.first_triangle = triangles_->add(group.deforming->triangle_count());
  deforms_ = true;
}

PlacedGroups RaycastScene::place(const RenderRequest& request) const {
  if (request.objects.size() + 1 != groups_.size()) {
    throw InternalError("a request names " + std::to_string(request.objects.size()) +
                        " moving objects, but the scene has " + std::to_string(groups_.size() - 1));
  }
  PlacedGroups placed;
  placed.triangles = deforms_ ? std::make_shared<SceneTriangles>(*triangles_) : triangles_;
  for (const Group& group : groups_) {
    const std::size_t index = placed.groups.size();
    const SE3 T_world_group = index == 0 ? SE3() : request.objects[index - 1].T_world_body;
    const SE3 T_group_camera = T_world_group.inverse() * request.camera.T_world_body;
    const Eigen::Matrix3f R_group_camera = T_group_camera.rotation.toRotationMatrix().cast<float>();
    const DeformingGroup* const deforming = group.deforming.get();
    const Eigen::AlignedBox3f box = deforming == nullptr ? group.bounds : deforming->bounds(request.t);
    placed.groups.push_back({deforming == nullptr ? &group.rigid : nullptr,
                             deforming == nullptr ? nullptr
                                                  : std::make_unique<DeformsLater>(*deforming, group.first_triangle,
                                                                                   request.t, *placed.triangles),
                             R_group_camera, R_group_camera.transpose(), T_group_camera.translation.cast<float>(),
                             bounds_in_view(box, T_group_camera), box, group.first_triangle});
  }
  return placed;
}

std::shared_ptr<const RaycastScene> build_raycast_scene(const Scene& scene) {
  return std::make_shared<const RaycastScene>(scene);
}

}  // namespace esim::inline backends::inline raycast

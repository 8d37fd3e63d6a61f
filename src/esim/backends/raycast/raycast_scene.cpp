#include "esim/backends/raycast/raycast_scene.h"

#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <cstring>
#include <string>

#include "esim/core/error.h"

namespace esim {
namespace {

TriangleShading shading_of(const Mesh& mesh, std::size_t index) {
  const auto& [uv0, uv1, uv2] = mesh.texture_uv[index];
  TriangleShading shading{};
  shading.u0 = uv0.x(), shading.v0 = uv0.y();
  shading.u1 = uv1.x() - uv0.x(), shading.v1 = uv1.y() - uv0.y();
  shading.u2 = uv2.x() - uv0.x(), shading.v2 = uv2.y() - uv0.y();
  shading.material = mesh.material[index];

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

void throw_on_error(RTCDevice device, const char* what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw UserError(std::string("mesh: Embree cannot ") + what +
                  (error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory; use a mesh with fewer triangles"
                                                    : ": error code " + std::to_string(error)));
}

}  // namespace

RaycastScene::RaycastScene(const Scene& scene) {
  if (scene.objects.size() != 1 || scene.objects[0].moves || scene.lighting)
    throw UserError("mesh: moving objects and light are not there yet");
  const Mesh& mesh = scene.objects[0].mesh;
  materials_ = mesh.materials;
  device_ = rtcNewDevice(nullptr);
  if (device_ == nullptr) throw_on_error(nullptr, "start");
  if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0) packet_size_ = 8;
  if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0) packet_size_ = 16;

  // Embree wants its buffers padded: it allocates them, and we copy.
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Eigen::Vector3f), mesh.vertices.size());
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(mesh.triangles[0]), mesh.triangles.size());
  throw_on_error(device_, "hold the mesh");
  std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  rtcCommitGeometry(geometry);

  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  // One thread builds the tree, so that it is the same in every run. (The device's own limit on threads would hold for
  // the whole process.)
  tbb::task_arena(1).execute([this] { rtcJoinCommitScene(scene_); });
  throw_on_error(device_, "build the scene");

  triangles_.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) triangles_.push_back(shading_of(mesh, i));
}

RaycastScene::~RaycastScene() {
  if (scene_ != nullptr) rtcReleaseScene(scene_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

std::shared_ptr<const RaycastScene> build_raycast_scene(const Scene& scene) {
  return std::make_shared<const RaycastScene>(scene);
}

}  // namespace esim

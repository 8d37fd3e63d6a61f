#include "esim/backends/raycast/triangles/group_triangles.h"

#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline backends::inline raycast {

namespace {

/// For each vertex, the first one in order that is at the same position.
std::vector<std::uint32_t> places_of(const std::vector<Eigen::Vector3f>& vertices) {
  const auto bits = [&](std::uint32_t i) {
    const auto of = [](float v) { return std::bit_cast<std::uint32_t>(v + 0.0F); };  // without minus zero
    return std::array{of(vertices[i].x()), of(vertices[i].y()), of(vertices[i].z())};
  };
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return std::pair(bits(i), i); });
  std::vector<std::uint32_t> places(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool is_same = i > 0 && bits(order[i]) == bits(order[i - 1]);
    places[order[i]] = is_same ? places[order[i - 1]] : order[i];
  }
  return places;
}

}  // namespace

TriangleShading::TriangleShading(const Mesh& mesh, std::size_t index, std::uint32_t first_material)
    : material(first_material + mesh.material[index]) {
  const auto& [uv0, uv1, uv2] = mesh.texture_uv[index];
  u0 = uv0.x(), v0 = uv0.y();
  u1 = uv1.x() - uv0.x(), v1 = uv1.y() - uv0.y();
  u2 = uv2.x() - uv0.x(), v2 = uv2.y() - uv0.y();
  const auto& [a, b, c] = mesh.triangles[index];
  place(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
}

/// The plane's dual basis gives barycentric coordinates per metre.
void TriangleShading::place(const Eigen::Vector3f& p0, const Eigen::Vector3f& p1, const Eigen::Vector3f& p2) {
  const Eigen::Vector3d e1 = (p1 - p0).cast<double>(), e2 = (p2 - p0).cast<double>();
  const Eigen::Vector3d normal = e1.cross(e2);
  const double area2 = normal.squaredNorm(), per_area2 = area2 > 0 ? 1 / area2 : 0;
  const Eigen::Vector3d dual1 = per_area2 * e2.cross(normal), dual2 = per_area2 * normal.cross(e1);
  Eigen::Map<Eigen::Vector3f>{gradient_u} = (u1 * dual1 + u2 * dual2).cast<float>();
  Eigen::Map<Eigen::Vector3f>{gradient_v} = (v1 * dual1 + v2 * dual2).cast<float>();
}

void connect(const Mesh& mesh, bool lit, std::span<TriangleShading> triangles) {
  const std::vector<std::uint32_t> places = places_of(mesh.vertices);
  struct Side {
    std::uint32_t other, triangle, corner;  // its end of the higher number; the corner opposite the side
  };
  const auto continues = [&](const Side& one, const Side& two) {
    const auto &here = mesh.triangles[one.triangle], &there = mesh.triangles[two.triangle];
    if (mesh.material[one.triangle] != mesh.material[two.triangle]) return false;
    const bool needs_normals = lit && !mesh.materials[mesh.material[one.triangle]].unlit;
    for (const std::uint32_t k : {(one.corner + 1) % 3, (one.corner + 2) % 3}) {
      const std::uint32_t next = (two.corner + 1) % 3, last = (two.corner + 2) % 3;
      const std::uint32_t l = places[there[next]] == places[here[k]] ? next : last;
      if (mesh.texture_uv[one.triangle][k] != mesh.texture_uv[two.triangle][l]) return false;
      if (!needs_normals) continue;
      if (mesh.normals.empty() || mesh.normals[here[k]].isZero()) return false;
      if (mesh.normals[here[k]] != mesh.normals[there[l]]) return false;
    }
    return true;
  };
  const auto connect_sides = [&](std::uint32_t end, std::span<Side> of_end) {
    std::ranges::sort(of_end, {}, [](const Side& side) { return std::pair(side.other, side.triangle); });
    for (std::size_t i = 0, next = 0; i < of_end.size(); i = next) {
      while (next < of_end.size() && of_end[next].other == of_end[i].other) ++next;
      const Side &one = of_end[i], &two = of_end[next - 1];
      if (next - i != 2 || one.other == end || one.triangle == two.triangle) continue;
      const auto apart = static_cast<std::int32_t>(two.triangle - one.triangle);
      const bool same = continues(one, two);
      triangles[one.triangle].next[one.corner] = {apart, same};
      triangles[two.triangle].next[two.corner] = {-apart, same};
    }
  };

  // Some ends at a time, so that few sides need memory.
  constexpr std::size_t kTimes = 16;
  const std::size_t count = (mesh.vertices.size() + kTimes - 1) / kTimes;
  std::vector<std::uint32_t> begin;  // of the sides of each end of the lower number
  std::vector<Side> sides;
  for (std::size_t first = 0; first < mesh.vertices.size(); first += count) {
    const auto for_each_side = [&](const auto& visit) {
      for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t a = places[mesh.triangles[i][(k + 1) % 3]], b = places[mesh.triangles[i][(k + 2) % 3]];
          if (const std::size_t end = std::min(a, b) - first; end < count) visit(end, Side{std::max(a, b), i, k});
        }
      }
    };
    begin.assign(count + 2, 0);
    for_each_side([&](std::size_t end, const Side&) { ++begin[end + 2]; });
    for (std::size_t i = 2; i < begin.size(); ++i) begin[i] += begin[i - 1];
    sides.resize(begin.back());
    for_each_side([&](std::size_t end, const Side& side) { sides[begin[end + 1]++] = side; });
    for (std::size_t end = 0; end < count; ++end) {
      connect_sides(static_cast<std::uint32_t>(first + end),
                    std::span(sides).subspan(begin[end], begin[end + 1] - begin[end]));
    }
  }
}

void throw_on_error(RTCDevice device, const char* what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw UserError(std::string("mesh: Embree cannot ") + what +
                  (error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory; use a mesh with fewer triangles"
                                                    : ": error code " + std::to_string(error)));
}

RayTriangles::RayTriangles(RTCDevice device, std::span<const Eigen::Vector3f> vertices,
                           std::span<const Corners> triangles, bool moves)
    : device_(device), scene_(rtcNewScene(device)) {
  rtcSetSceneFlags(scene_.get(), moves ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_ROBUST);
  // Slower to build, faster to query.
  rtcSetSceneBuildQuality(scene_.get(), moves ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
  // Embree requires padded buffers: it allocates them, and the data are copied.
  geometry_ = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (moves) rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
  void* const to_vertices = rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                    sizeof(Eigen::Vector3f), vertices.size());
  void* const to_triangles = rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                     sizeof(triangles[0]), triangles.size());
  throw_on_error(device, "store the mesh");
  std::memcpy(to_vertices, vertices.data(), vertices.size_bytes());
  std::memcpy(to_triangles, triangles.data(), triangles.size_bytes());
  rtcCommitGeometry(geometry_);
  rtcAttachGeometry(scene_.get(), geometry_);
  rtcReleaseGeometry(geometry_);
  commit();
}

void RayTriangles::refit(std::span<const Eigen::Vector3f> vertices) {
  std::memcpy(rtcGetGeometryBufferData(geometry_, RTC_BUFFER_TYPE_VERTEX, 0), vertices.data(), vertices.size_bytes());
  rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(geometry_);
  commit();
}

/// One thread builds the hierarchy, so that it is the same in every run. (The device's own limit on threads would
/// affect the complete process.)
void RayTriangles::commit() {
  tbb::task_arena(1).execute([this] { rtcJoinCommitScene(scene_.get()); });
  throw_on_error(device_, "build the scene");
}

bool TriangleUse::wants_tree(std::size_t triangles) const {
  constexpr std::size_t kMaxForRays = 20'000;  // with more, most parts of an image see too many of them
  return surfaces || triangles <= kMaxForRays;
}

}  // namespace esim::inline backends::inline raycast

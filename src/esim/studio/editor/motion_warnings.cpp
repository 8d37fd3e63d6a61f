#include "esim/studio/editor/motion_warnings.h"

#include <fmt/format.h>

#include <functional>
#include <numbers>

namespace esim::studio {
namespace {

// A hand-held camera stays below these limits.
constexpr double kFastTurn_rad_per_s = 720 * std::numbers::pi / 180, kFast_m_per_s2 = 50;
constexpr double kMaxTests = 4e8;     // of two triangles' boxes: about a second
constexpr std::size_t kStretch = 16;  // intervals of the path that are first tested together

/// Whether the segment from a to b intersects a triangle (Möller and Trumbore 1997).
bool meets(const Eigen::Vector3f& a, const Eigen::Vector3f& along, const Eigen::Vector3f& p, const Eigen::Vector3f& q,
           const Eigen::Vector3f& r) {
  const Eigen::Vector3f e1 = q - p, e2 = r - p, h = along.cross(e2);
  const float determinant = e1.dot(h);
  if (std::abs(determinant) < 1e-12F) return false;
  const float f = 1 / determinant;
  const Eigen::Vector3f s = a - p;
  const float u = f * s.dot(h);
  if (u < 0 || u > 1) return false;
  const Eigen::Vector3f w = s.cross(e1);
  const float v = f * along.dot(w);
  if (v < 0 || u + v > 1) return false;
  const float t = f * e2.dot(w);
  return t >= 0 && t <= 1;
}

/// One warning for each run of consecutive intervals.
void add_stretches(const std::vector<MotionSample>& course, const std::function<bool(std::size_t)>& is_so,
                   const std::string& what, std::vector<MotionWarning>& warnings) {
  bool within = false;
  for (std::size_t i = 0; i + 1 < course.size(); ++i) {
    const bool now = is_so(i);
    if (now && !within) warnings.push_back({course[i].t, course[i + 1].t, what});
    if (now && within) warnings.back().to = course[i + 1].t;
    within = now;
  }
}

/// For each segment between consecutive camera positions, whether it intersects a static triangle; empty if the test
/// would take too long.
std::vector<bool> ways_through(const std::vector<Eigen::Vector3f>& eyes, const Scene& scene) {
  const std::size_t count = eyes.empty() ? 0 : eyes.size() - 1;
  std::vector<bool> through(count);
  std::vector<Eigen::AlignedBox3f> stretches(count / kStretch + 1);
  Eigen::AlignedBox3f whole;
  for (std::size_t i = 0; i <= count && !eyes.empty(); ++i) {
    whole.extend(eyes[i]);
    stretches[std::min(i, count - 1) / kStretch].extend(eyes[i]);
    if (i > 0) stretches[(i - 1) / kStretch].extend(eyes[i]);
  }
  double triangles = 0;
  for (const SceneObject& object : scene.objects)
    triangles += object.moves ? 0 : static_cast<double>(object.mesh.triangles.size());
  if (count == 0 || triangles * static_cast<double>(stretches.size()) > kMaxTests) return through;

  const auto test = [&](const Eigen::AlignedBox3f& around, const std::array<Eigen::Vector3f, 3>& triangle,
                        std::size_t from) {
    for (std::size_t i = from; i < std::min(from + kStretch, count); ++i) {
      Eigen::AlignedBox3f way(eyes[i]);
      way.extend(eyes[i + 1]);
      const Eigen::Vector3f along = eyes[i + 1] - eyes[i];
      if (through[i] || along.squaredNorm() == 0 || !around.intersects(way)) continue;
      through[i] = meets(eyes[i], along, triangle[0], triangle[1], triangle[2]);
    }
  };
  for (const SceneObject& object : scene.objects) {
    if (object.moves) continue;
    const auto& v = object.mesh.vertices;
    for (const auto& [p, q, r] : object.mesh.triangles) {
      Eigen::AlignedBox3f around(v[p]);
      around.extend(v[q]), around.extend(v[r]);
      if (!around.intersects(whole)) continue;
      for (std::size_t k = 0; k < stretches.size(); ++k) {
        if (around.intersects(stretches[k])) test(around, {v[p], v[q], v[r]}, k * kStretch);
      }
    }
  }
  return through;
}

}  // namespace

std::vector<MotionWarning> motion_warnings(const std::vector<MotionSample>& course, const SE3& T_body_camera,
                                           const Scene& scene) {
  std::vector<Eigen::Vector3f> eyes;
  for (const MotionSample& sample : course)
    eyes.push_back((sample.body.T_world_body * T_body_camera.translation).cast<float>());

  Eigen::AlignedBox3f box;
  for (const SceneObject& object : scene.objects) {
    if (object.moves) continue;
    for (const Eigen::Vector3f& vertex : object.mesh.vertices) box.extend(vertex);
  }

  std::vector<MotionWarning> warnings;
  const std::vector<bool> through = ways_through(eyes, scene);
  add_stretches(
      course, [&](std::size_t i) { return through[i]; }, "the camera passes through a surface", warnings);
  if (!box.isEmpty()) {
    add_stretches(
        course, [&](std::size_t i) { return !box.contains(eyes[i]) && box.contains(eyes.front()); },
        "the camera leaves the scene", warnings);
  }
  add_stretches(
      course, [&](std::size_t i) { return course[i].body.omega_body.norm() > kFastTurn_rad_per_s; },
      "turns faster than 720 deg/s", warnings);
  add_stretches(
      course, [&](std::size_t i) { return course[i].body.acceleration_world.norm() > kFast_m_per_s2; },
      fmt::format("accelerates above {} m/s2", kFast_m_per_s2), warnings);
  return warnings;
}

}  // namespace esim::studio

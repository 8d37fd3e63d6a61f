#include "esim/studio/scene_view/first_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "esim/scenario/pose_options.h"

namespace esim::studio {
namespace {

using Eigen::Vector2f;

constexpr float kEyes_m = 1.6F;           // above the floor
constexpr float kEyesOfLowRooms = 0.65F;  // fraction of the height of scenes that are lower than a room
constexpr float kClearance_m = 0.45F;     // from walls and furniture
constexpr double kRoomHeight_m = 1.5, kRoomWidth_m = 2;
constexpr float kLevel = 0.95F;    // minimum upward component of a floor's normal
constexpr float kStorey_m = 0.3F;  // maximum height difference within one floor
constexpr float kWide = 0.25F;     // minimum area of a wide floor, relative to the widest
constexpr std::size_t kMaxFloors = 6;
constexpr float kHighest_m = 1e5F;
constexpr double kDown = 0.12;                // downward slope of the view, so that the floor is visible
constexpr int kDirections = 48, kPlaces = 5;  // even; odd
constexpr float kMostlyEnclosed = 0.75F;
constexpr double kHalfAngle_rad = 32.5 * std::numbers::pi / 180;

/// The intersection of a surface with a horizontal plane; `front` is its horizontal normal on the visible side.
struct Wall {
  Vector2f a, b, front;
};

template <typename See>
void each_object(const Scene& scene, const See& see) {
  const bool any_still = std::any_of(scene.objects.begin(), scene.objects.end(),
                                     [](const SceneObject& o) { return !o.moves && !o.mesh.vertices.empty(); });
  for (const SceneObject& object : scene.objects) {
    if (!object.moves || !any_still) see(object.mesh);
  }
}

std::vector<Wall> walls_at(const Scene& scene, float z) {
  std::vector<Wall> walls;
  each_object(scene, [&](const Mesh& mesh) {
    for (const auto& corners : mesh.triangles) {
      std::array<Vector2f, 3> cut;
      int cuts = 0;
      for (int i = 0; i < 3; ++i) {
        const auto& p = mesh.vertices[corners[i]];
        const auto& q = mesh.vertices[corners[(i + 1) % 3]];
        if ((p.z() > z) == (q.z() > z)) continue;
        cut[cuts++] = (p + (z - p.z()) / (q.z() - p.z()) * (q - p)).head<2>();
      }
      if (cuts != 2) continue;
      const auto& p = mesh.vertices[corners[0]];
      const Eigen::Vector3f normal = (mesh.vertices[corners[1]] - p).cross(mesh.vertices[corners[2]] - p);
      walls.push_back({cut[0], cut[1], normal.head<2>()});
    }
  });
  return walls;
}

struct Sight {
  float distance = std::numeric_limits<float>::infinity();
  bool front = false;  ///< whether the nearest surface is seen from its front
};

Sight sight(const std::vector<Wall>& walls, const Vector2f& from, const Vector2f& along) {
  const auto cross = [](const Vector2f& a, const Vector2f& b) { return a.x() * b.y() - a.y() * b.x(); };
  Sight nearest;
  for (const Wall& wall : walls) {
    const Vector2f way = wall.b - wall.a, to = wall.a - from;
    const float across = cross(along, way);
    if (across == 0) continue;
    const float distance = cross(to, way) / across, fraction = cross(to, along) / across;
    if (distance < 0 || distance >= nearest.distance || fraction < 0 || fraction > 1) continue;
    nearest = {distance, wall.front.dot(along) < 0};
  }
  return nearest;
}

float clearance(const std::vector<Wall>& walls, const Vector2f& at) {
  float min = std::numeric_limits<float>::infinity();
  for (const Wall& wall : walls) {
    const Vector2f way = wall.b - wall.a;
    const float length2 = way.squaredNorm();
    const float fraction = length2 > 0 ? std::clamp((at - wall.a).dot(way) / length2, 0.0F, 1.0F) : 0;
    min = std::min(min, (wall.a + fraction * way - at).norm());
  }
  return min;
}

/// The floor area at one level.
struct Floor {
  float z = std::numeric_limits<float>::infinity();
  Eigen::AlignedBox2f extent{};
  float area = 0;
};

/// The wide floors, from the lowest up.
std::vector<Floor> floors_of(const Scene& scene) {
  std::map<int, Floor> levels;
  each_object(scene, [&](const Mesh& mesh) {
    for (const auto& corners : mesh.triangles) {
      const auto& p = mesh.vertices[corners[0]];
      const auto& q = mesh.vertices[corners[1]];
      const auto& r = mesh.vertices[corners[2]];
      const Eigen::Vector3f normal = (q - p).cross(r - p);
      if (!(normal.z() > kLevel * normal.norm()) || !(std::abs(p.z()) < kHighest_m)) continue;
      Floor& floor = levels[static_cast<int>(std::floor(p.z() / kStorey_m))];
      floor.area += normal.z();
      floor.z = std::min(floor.z, p.z());
      for (const auto* corner : {&p, &q, &r}) floor.extent.extend(corner->head<2>());
    }
  });
  float widest = 0;
  for (const auto& [level, floor] : levels) widest = std::max(widest, floor.area);
  std::vector<Floor> floors;
  for (const auto& [level, floor] : levels) {
    if (floor.area >= kWide * widest && floors.size() < kMaxFloors) floors.push_back(floor);
  }
  return floors;
}

SE3 looking(const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  return {looking_along(along.normalized()), from};
}

/// The point of a floor furthest back from `middle` with enough clearance.
Vector2f standing(const std::vector<Wall>& walls, const Eigen::AlignedBox2f& floor, const Vector2f& middle,
                  const Vector2f& along, float behind) {
  constexpr int kSteps = 20;
  for (int step = kSteps; step > 0; --step) {
    const Vector2f at = middle - along * (behind * static_cast<float>(step) / kSteps);
    if (floor.contains(at) && clearance(walls, at) >= kClearance_m) return at;
  }
  return middle;
}

/// A view across the middle of a floor's room; empty without surrounding walls.
std::optional<SE3> view_inside(const Scene& scene, const Floor& floor, float ceiling) {
  const float z = floor.z + std::min(kEyes_m, kEyesOfLowRooms * (ceiling - floor.z));
  const std::vector<Wall> walls = walls_at(scene, z);
  const Vector2f centre = floor.extent.center(), size = floor.extent.sizes();
  std::optional<SE3> best;
  float longest = 0;
  for (int place = 0; place < kPlaces * kPlaces; ++place) {
    constexpr int kHalf = kPlaces / 2;
    const Vector2f fraction(static_cast<float>(place % kPlaces - kHalf), static_cast<float>(place / kPlaces - kHalf));
    const Vector2f at = centre + fraction.cwiseProduct(size) / (2 * kPlaces);
    std::array<Sight, kDirections> around;
    std::array<Vector2f, kDirections> directions;
    int seen = 0;
    for (int k = 0; k < kDirections; ++k) {
      const float angle = 2 * std::numbers::pi_v<float> * (static_cast<float>(k) + 0.3F) / kDirections;
      directions[k] = {std::cos(angle), std::sin(angle)};
      around[k] = sight(walls, at, directions[k]);
      seen += std::isfinite(around[k].distance) && around[k].front ? 1 : 0;
    }
    if (static_cast<float>(seen) < kMostlyEnclosed * kDirections) continue;
    for (int k = 0; k < kDirections; ++k) {
      const float ahead = std::min(around[k].distance, size.norm());
      const float behind = std::min(around[(k + kDirections / 2) % kDirections].distance, size.norm());
      const float length = std::min(ahead, 2 * behind) + behind - (at - centre).norm();
      if (length <= longest) continue;
      longest = length;
      const Vector2f from = standing(walls, floor.extent, at, directions[k], behind);
      best = looking({from.x(), from.y(), z}, {directions[k].x(), directions[k].y(), -kDown});
    }
  }
  return best;
}

SE3 view_from_outside(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d along = Eigen::Vector3d(0.75, 1, -0.6).normalized();
  return looking(box.center() - 0.5 * box.diagonal().norm() / std::sin(kHalfAngle_rad) * along, along);
}

}  // namespace

SE3 first_view(const Scene& scene) {
  Eigen::AlignedBox3f box;
  each_object(scene, [&](const Mesh& mesh) {
    for (const Eigen::Vector3f& vertex : mesh.vertices) box.extend(vertex);
  });
  if (box.isEmpty()) return looking(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX());
  for (const Floor& floor : floors_of(scene)) {
    if (const auto inside = view_inside(scene, floor, box.max().z())) return *inside;
  }
  return view_from_outside(box.cast<double>());
}

SE3 first_view_of_splats(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d size = box.sizes(), middle = box.center();
  if (size.z() < kRoomHeight_m || size.head<2>().minCoeff() < kRoomWidth_m) return view_from_outside(box);
  const Eigen::Vector3d along = size.x() > size.y() ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  Eigen::Vector3d from = middle - 0.25 * size.cwiseProduct(along);
  from.z() = box.min().z() + std::min<double>(kEyes_m, kEyesOfLowRooms * size.z());
  return looking(from, along - kDown * Eigen::Vector3d::UnitZ());
}

}  // namespace esim::studio

#include "esim/reproject/frames/object_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "esim/geometry/so3.h"
#include "esim/reproject/lens.h"

namespace esim::inline reproject {
namespace {

constexpr double kMoves_px = 0.25;    // between motion vectors and the motion of the camera, px of the sensor
constexpr double kExact_px = 0.06;    // between exact motion vectors and a rigid motion, px of the sensor
constexpr double kRoughly_px = 0.5;   // between others and it
constexpr int kSmallest = 12;         // pixels of an object; smaller parts are noise of the motion vectors
constexpr int kTurning = 60;          // pixels of an object whose rotation is determined
constexpr std::size_t kUsed = 2000;   // pixels per object
constexpr int kMaxObjects = 1000;     // found in an image
constexpr float kSameObject = 0.05F;  // relative difference of the nearness of neighbours

/// What a pixel of the later frame says: where its point would have been in the earlier camera if it had not moved,
/// and the pixel in which it was.
struct Observation {
  Eigen::Vector3d point;
  Eigen::Vector2d pixel;
  std::size_t index;  // of the pixel
};

/// A rigid motion in the earlier camera's frame: a point p moves to R (p - middle) + middle + shift.
struct Rigid {
  Eigen::Vector3d middle;
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const { return R * (p - middle) + middle + shift; }
  SE3 transform() const { return {R, middle + shift - R * middle}; }
};

/// Distance between where the motion says a point was and where it was; infinite if it is not in front of the camera.
double distance_px(const Camera& camera, const Rigid& motion, const Observation& seen) {
  const auto at = camera.project(motion(seen.point));
  return at ? (at->pixel - seen.pixel).norm() : std::numeric_limits<double>::infinity();
}

/// Huber's sum of distances.
double cost(const Camera& camera, const Rigid& motion, const std::vector<Observation>& seen, double huber) {
  double sum = 0;
  for (const Observation& one : seen) {
    const double d = std::min(distance_px(camera, motion, one), 1e4);
    sum += d <= huber ? 0.5 * d * d : huber * (d - 0.5 * huber);
  }
  return sum;
}

Rigid fit(const Camera& camera, const std::vector<Observation>& all, double huber) {
  std::vector<Observation> seen;
  const std::size_t stride = (all.size() + kUsed - 1) / kUsed;
  for (std::size_t i = 0; i < all.size(); i += stride) seen.push_back(all[i]);
  Rigid best{.middle = Eigen::Vector3d::Zero()};
  for (const Observation& one : seen) best.middle += one.point / static_cast<double>(seen.size());
  const Eigen::Index first = all.size() < kTurning ? 3 : 0;  // without rotation
  double lowest = cost(camera, best, seen, huber), damping = 1e-3;
  for (int step = 0; step < 30 && damping < 1e6; ++step) {
    Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
    for (const Observation& one : seen) {
      const auto at = camera.project(best(one.point));
      if (!at) continue;
      const Eigen::Vector2d off = at->pixel - one.pixel;
      const double weight = std::min(1.0, huber / std::max(off.norm(), 1e-12));
      Eigen::Matrix<double, 2, 6> J;
      J.leftCols<3>() = -at->jacobian * hat(best.R * (one.point - best.middle));
      J.rightCols<3>() = at->jacobian;
      A.noalias() += weight * J.transpose() * J, b.noalias() += weight * J.transpose() * off;
    }
    const Eigen::Index size = 6 - first;
    Eigen::MatrixXd damped = A.bottomRightCorner(size, size);
    damped.diagonal() += damping * damped.diagonal() +
                         Eigen::VectorXd::Constant(size, 1e-12 * std::max(damped.diagonal().maxCoeff(), 1e-30));
    Eigen::Matrix<double, 6, 1> change = Eigen::Matrix<double, 6, 1>::Zero();
    change.tail(size) = -damped.ldlt().solve(b.tail(size));
    if (!change.allFinite()) break;
    Rigid next = best;
    next.R = (so3_exp(change.head<3>()) * best.R).normalized(), next.shift += change.tail<3>();
    const double reached = cost(camera, next, seen, huber);
    const bool better = reached < lowest, settled = better && lowest - reached < 1e-9 * lowest;
    if (better) best = next, lowest = reached;
    damping *= better ? 0.2 : 5;
    if (settled) break;
  }
  return best;
}

/// The parts of an image that are connected and marked, as lists of pixels; neighbours on different surfaces are not
/// connected.
std::vector<std::vector<std::size_t>> connected_parts(const Image<float>& depth, std::vector<bool> marked) {
  const int width = depth.width(), height = depth.height();
  const auto z = depth.pixels();
  std::vector<std::vector<std::size_t>> parts;
  for (std::size_t start = 0; start < marked.size(); ++start) {
    if (!marked[start]) continue;
    std::vector<std::size_t> part = {start};
    marked[start] = false;
    for (std::size_t next = 0; next < part.size(); ++next) {
      const std::size_t at = part[next];
      const int x = static_cast<int>(at) % width, y = static_cast<int>(at) / width;
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
        const auto to = static_cast<std::size_t>((y + dy) * width + x + dx);
        if (!marked[to] || std::fabs(z[at] - z[to]) > kSameObject * std::min(z[at], z[to])) continue;
        marked[to] = false;
        part.push_back(to);
      }
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

/// The nearness at a place of an image: the farthest and the nearest of the four pixels around it.
std::pair<float, float> nearness_around(const Image<float>& depth, double u, double v) {
  float low = std::numeric_limits<float>::infinity(), high = 0;
  for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
    const float z = depth(static_cast<int>(u) + dx, static_cast<int>(v) + dy), w = z > 0 ? 1 / z : 0.0F;
    low = std::min(low, w), high = std::max(high, w);
  }
  return {low, high};
}

/// A search for objects in the motion vectors of a frame.
class Search {
 public:
  Search(const KeyframeLayout& layout, const PixelRays& rays, const PosedFrame& then, const PosedFrame& now,
         const Workers& workers)
      : camera_(layout.camera),
        rays_(rays),
        then_(then),
        now_(now),
        workers_(workers),
        per_sensor_px_(layout.supersampling),
        T_then_now_(then.T_world_camera.inverse() * now.T_world_camera),
        moves_(now.depth.size()) {
    result_.object_now = Image<std::uint16_t>(now.depth.width(), now.depth.height());
    observe();
  }

  ObjectMotions find() {
    const std::vector<std::vector<std::size_t>> parts =
        now_.object.empty() ? connected_parts(now_.depth, moves_) : labelled_parts();
    std::vector<Observation> left;
    for (const std::vector<std::size_t>& part : parts) {
      std::vector<Observation> seen;
      for (const std::size_t pixel : part) {
        if (observations_[pixel].pixel.allFinite()) seen.push_back(observations_[pixel]);
      }
      add_objects(seen);
      left.insert(left.end(), seen.begin(), seen.end());
    }
    const std::size_t left_out = join_objects(left);
    const auto pixels = static_cast<double>(now_.depth.size());
    result_.moving = static_cast<double>(std::count(moves_.begin(), moves_.end(), true)) / pixels;
    result_.not_rigid = static_cast<double>(left_out) / pixels;
    label_earlier_frame();
    return std::move(result_);
  }

 private:
  /// Compares the motion vectors with the motion of the camera.
  void observe() {
    const int width = now_.depth.width(), height = now_.depth.height();
    observations_.resize(now_.depth.size());
    std::vector<std::uint8_t> moves(now_.depth.size());
    workers_.for_each(height, [&](int y) {
      for (int x = 0; x < width; ++x) {
        const auto index = static_cast<std::size_t>(y * width + x);
        Observation& seen = observations_[index];
        seen.index = index;
        seen.pixel.setConstant(std::numeric_limits<double>::quiet_NaN());
        const double z = now_.depth(x, y), mx = now_.motion_x(x, y), my = now_.motion_y(x, y);
        if (!(z > 0) || !std::isfinite(z) || !std::isfinite(mx) || !std::isfinite(my)) continue;
        seen.point = T_then_now_ * Eigen::Vector3d(z * rays_.x(x, y), z * rays_.y(x, y), z);
        seen.pixel = {x - mx, y - my};
        const auto at = camera_.project(seen.point);
        moves[index] = at && (at->pixel - seen.pixel).norm() > kMoves_px * per_sensor_px_ ? 1 : 0;
      }
    });
    std::copy(moves.begin(), moves.end(), moves_.begin());
  }

  /// The pixels of each object that the later frame names.
  std::vector<std::vector<std::size_t>> labelled_parts() const {
    std::vector<std::vector<std::size_t>> parts;
    for (std::size_t i = 0; i < now_.object.size(); ++i) {
      const std::size_t object = now_.object.pixels()[i];
      if (object == 0) continue;
      if (object > parts.size()) parts.resize(object);
      parts[object - 1].push_back(i);
    }
    std::erase_if(parts, [&](const auto& part) {
      return std::none_of(part.begin(), part.end(), [&](std::size_t pixel) { return moves_[pixel]; });
    });
    return parts;
  }

  /// Adds the motions of a part of the image: first those to which many pixels fit exactly, since two objects that
  /// touch each other fit roughly to one motion. Keeps the pixels that fit to none.
  void add_objects(std::vector<Observation>& seen) {
    constexpr int kMaxMotions = 4;
    constexpr double kMany = 0.3;
    for (const double tolerance_px : {kExact_px, kRoughly_px}) {
      const double within_px = tolerance_px * per_sensor_px_;
      for (int i = 0; i < kMaxMotions && seen.size() >= kSmallest && result_.then.size() < kMaxObjects; ++i) {
        const Rigid motion = most_common(seen, within_px);
        std::vector<Observation> others = seen;
        const std::vector<Observation> fitting = take_fitting(motion, within_px, others);
        if (static_cast<double>(fitting.size()) < kMany * static_cast<double>(seen.size())) break;
        if (fitting.size() < kSmallest) break;
        add(motion, fitting);
        seen = std::move(others);
      }
    }
  }

  /// Gives pixels, such as those of parts that are too small, to the object to whose motion they fit best. Returns the
  /// number of those that fit to none.
  std::size_t join_objects(const std::vector<Observation>& pixels) {
    std::size_t left_out = 0;
    for (const Observation& one : pixels) {
      double nearest = kRoughly_px * per_sensor_px_;
      std::size_t object = 0;
      for (std::size_t i = 0; i < motions_.size(); ++i) {
        const double distance = distance_px(camera_, motions_[i], one);
        if (distance <= nearest) nearest = distance, object = i + 1;
      }
      result_.object_now.pixels()[one.index] = static_cast<std::uint16_t>(object);
      left_out += object == 0;
    }
    return left_out;
  }

  /// The motion to which most pixels fit. It is fitted to all pixels and to several small areas, then to those that
  /// fit.
  Rigid most_common(const std::vector<Observation>& seen, double within_px) const {
    constexpr std::size_t kAreas = 8;
    constexpr double kAllShare = 0.99, kRadius_px = 6;
    constexpr int kRounds = 4;
    Rigid best{.middle = Eigen::Vector3d::Zero()};
    std::size_t most = 0;
    const auto all_fit = [&] { return static_cast<double>(most) >= kAllShare * static_cast<double>(seen.size()); };
    const auto try_from = [&](std::vector<Observation> some) {
      for (int round = 0; round < kRounds && some.size() >= kSmallest && !all_fit(); ++round) {
        const Rigid motion = fit(camera_, some, within_px);
        std::vector<Observation> others = seen;
        some = take_fitting(motion, within_px, others);
        if (some.size() > most) best = motion, most = some.size();
      }
    };
    try_from(seen);
    for (std::size_t k = 0; k < kAreas && !all_fit(); ++k) {
      const Eigen::Vector2d middle = place(seen[(2 * k + 1) * seen.size() / (2 * kAreas)]);
      std::vector<Observation> near;
      for (const Observation& one : seen)
        if ((place(one) - middle).norm() <= kRadius_px * per_sensor_px_) near.push_back(one);
      try_from(std::move(near));
    }
    return best;
  }

  Eigen::Vector2d place(const Observation& seen) const {
    const auto width = static_cast<std::size_t>(now_.depth.width());
    return {static_cast<double>(seen.index % width), static_cast<double>(seen.index / width)};
  }

  /// Removes the pixels that fit, and returns them.
  std::vector<Observation> take_fitting(const Rigid& motion, double within_px, std::vector<Observation>& from) const {
    const auto rest = std::stable_partition(from.begin(), from.end(), [&](const Observation& one) {
      return distance_px(camera_, motion, one) > within_px;
    });
    std::vector<Observation> fitting(rest, from.end());
    from.erase(rest, from.end());
    return fitting;
  }

  void add(const Rigid& motion, const std::vector<Observation>& seen) {
    const SE3 T_world_then = then_.T_world_camera;
    const SE3 moved = T_world_then * motion.transform() * T_world_then.inverse();  // of world points, back in time
    const SE3 now{Eigen::Quaterniond::Identity(), T_world_then * motion.middle};
    result_.now.push_back(now), result_.then.push_back(moved * now);
    motions_.push_back(motion);
    const auto object = static_cast<std::uint16_t>(result_.now.size());
    for (const Observation& one : seen) result_.object_now.pixels()[one.index] = object;
    Eigen::AlignedBox2d& box = seen_then_.emplace_back();
    for (const Observation& one : seen) box.extend(one.pixel);
  }

  /// An object covers a pixel of the earlier frame if the point there, moved with the object, is on the object in the
  /// later frame; and if, were it part of the static scene, the later frame would see it but sees something farther.
  void label_earlier_frame() {
    const int width = then_.depth.width(), height = then_.depth.height();
    result_.object_then = Image<std::uint16_t>(width, height);
    const SE3 T_now_then = T_then_now_.inverse();
    for (std::size_t i = 0; i < result_.now.size(); ++i) {
      const SE3 T_now_object =
          now_.T_world_camera.inverse() * result_.now[i] * result_.then[i].inverse() * then_.T_world_camera;
      constexpr double kAround = 3;  // px
      const Eigen::AlignedBox2d& box = seen_then_[i];
      const int left = std::clamp(static_cast<int>(box.min().x() - kAround), 0, width);
      const int right = std::clamp(static_cast<int>(box.max().x() + kAround) + 1, 0, width);
      const int top = std::clamp(static_cast<int>(box.min().y() - kAround), 0, height);
      const int bottom = std::clamp(static_cast<int>(box.max().y() + kAround) + 1, 0, height);
      std::vector<std::size_t> gone;
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          const double z = then_.depth(x, y);
          if (!(z > 0) || !std::isfinite(z)) continue;
          const Eigen::Vector3d point(z * rays_.x(x, y), z * rays_.y(x, y), z);
          if (is_on(i, T_now_object * point)) {
            result_.object_then(x, y) = static_cast<std::uint16_t>(i + 1);
          } else if (is_seen_through(T_now_then * point)) {
            gone.push_back(static_cast<std::size_t>(y * width + x));
          }
        }
      }
      for (int sweep = 0; sweep < 3; ++sweep) join_neighbours(gone);
    }
  }

  /// Whether the later frame sees object i at a point of its camera's frame.
  bool is_on(std::size_t i, const Eigen::Vector3d& point) const {
    const auto at = inside(point);
    if (!at) return false;
    const auto [low, high] = nearness_around(now_.depth, at->x(), at->y());
    const double w = 1 / point.z();
    if (w < low * (1 - kSameObject) || w > high * (1 + kSameObject)) return false;
    const int u = static_cast<int>(at->x() + 0.5), v = static_cast<int>(at->y() + 0.5);
    return result_.object_now(u, v) == i + 1;
  }

  /// Whether the later frame sees only what is behind the point.
  bool is_seen_through(const Eigen::Vector3d& point) const {
    const auto at = inside(point);
    return at && nearness_around(now_.depth, at->x(), at->y()).second < (1 - kSameObject) / point.z();
  }

  /// The pixel of a point, if all four pixels around it are in the image.
  std::optional<Eigen::Vector2d> inside(const Eigen::Vector3d& point) const {
    const auto at = camera_.project(point);
    const int width = now_.depth.width(), height = now_.depth.height();
    if (!at || !(at->pixel.x() >= 0) || !(at->pixel.y() >= 0)) return std::nullopt;
    if (!(at->pixel.x() < width - 1) || !(at->pixel.y() < height - 1)) return std::nullopt;
    return at->pixel;
  }

  /// Gives pixels the object of a neighbour on the same surface.
  void join_neighbours(const std::vector<std::size_t>& pixels) {
    const int width = then_.depth.width(), height = then_.depth.height();
    for (const std::size_t pixel : pixels) {
      const int x = static_cast<int>(pixel) % width, y = static_cast<int>(pixel) / width;
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const int u = std::clamp(x + dx, 0, width - 1), v = std::clamp(y + dy, 0, height - 1);
        const float here = then_.depth(x, y), there = then_.depth(u, v);
        if (result_.object_then(x, y) == 0 && std::fabs(here - there) <= kSameObject * here)
          result_.object_then(x, y) = result_.object_then(u, v);
      }
    }
  }

  const Camera& camera_;
  const PixelRays& rays_;
  const PosedFrame &then_, &now_;
  const Workers& workers_;
  double per_sensor_px_;  // pixels of a frame
  SE3 T_then_now_;
  std::vector<bool> moves_;                     // differently from the static scene
  std::vector<Observation> observations_;       // of each pixel of the later frame
  std::vector<Eigen::AlignedBox2d> seen_then_;  // around the pixels of each object in the earlier frame
  std::vector<Rigid> motions_;                  // of the objects
  ObjectMotions result_;
};

}  // namespace

ObjectMotions find_object_motions(const KeyframeLayout& layout, const PixelRays& rays, const PosedFrame& then,
                                  const PosedFrame& now, const Workers& workers) {
  return Search(layout, rays, then, now, workers).find();
}

}  // namespace esim::inline reproject

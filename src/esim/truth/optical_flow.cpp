#include "esim/truth/optical_flow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace esim::inline truth {
namespace {

constexpr double kTolerance = 0.005;  // of 1 / depth
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// Rotations from each object's frame to the camera at `to`.
std::vector<Eigen::Matrix3d> rotations(const RenderRequest& to) {
  std::vector<Eigen::Matrix3d> result = {Eigen::Matrix3d::Identity()};
  for (const Kinematics& object : to.objects) {
    const Eigen::Quaterniond R_camera_world = to.camera.T_world_body.rotation.conjugate();
    result.emplace_back((R_camera_world * object.T_world_body.rotation).toRotationMatrix());
  }
  return result;
}

/// Transforms from the camera at `from` to the camera at `to`: for the static scene, then for each moving object.
std::vector<SE3> motions(const RenderRequest& from, const RenderRequest& to) {
  const SE3 T_world_camera0 = from.camera.T_world_body, T_camera1_world = to.camera.T_world_body.inverse();
  std::vector<SE3> result = {T_camera1_world * T_world_camera0};
  for (std::size_t i = 0; i < from.objects.size(); ++i) {
    const SE3 moved = to.objects[i].T_world_body * from.objects[i].T_world_body.inverse();
    result.push_back(T_camera1_world * moved * T_world_camera0);
  }
  return result;
}

/// Whether a camera with this depth image sees a point of inverse depth `nearness` at (u, v), within the image.
bool is_seen(const Image<float>& depth, double u, double v, double nearness) {
  const auto near = [&](int x, int y) {
    return 1.0 / double{depth(std::clamp(x, 0, depth.width() - 1), std::clamp(y, 0, depth.height() - 1))};
  };
  const int x = std::clamp(static_cast<int>(std::floor(u)), 0, std::max(depth.width() - 2, 0));
  const int y = std::clamp(static_cast<int>(std::floor(v)), 0, std::max(depth.height() - 2, 0));
  const auto [farthest, nearest] = std::minmax({near(x, y), near(x + 1, y), near(x, y + 1), near(x + 1, y + 1)});
  const double here = near(static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v)));
  return nearness >= here - 0.5 * (nearest - farthest) - kTolerance * here;
}

}  // namespace

OpticalFlowFromDepth::OpticalFlowFromDepth(const Camera& camera, std::shared_ptr<const DeformingSurfaces> surfaces,
                                           const Workers& workers)
    : camera_(camera), surfaces_(std::move(surfaces)), bearings_(bearings_of(camera)), workers_(workers) {
  optical_flow_.x = optical_flow_.y = Image<float>(camera.width, camera.height);
  optical_flow_.visible = Image<std::uint8_t>(camera.width, camera.height);
}

const OpticalFlowImages* OpticalFlowFromDepth::advance(const RenderRequest& view, const Sample& sample) {
  const bool first = !before_;
  if (!first) compute(*before_, view, sample.depth);
  before_ = {view, sample.depth, sample.object, sample.surface};
  return first ? nullptr : &optical_flow_;
}

void OpticalFlowFromDepth::save(StateWriter& archive) const {
  archive.value(before_.has_value());
  if (!before_) return;
  archive.value(before_->view.t);
  archive.sized_image(before_->depth);
  archive.sized_image(before_->object);
  archive.sized_image(before_->surface);
}

void OpticalFlowFromDepth::restore(StateReader& archive, const std::function<RenderRequest(TimeNs)>& view_at) {
  before_.reset();
  bool any = false;
  archive.value(any);
  if (!any) return;
  TimeNs t = 0;
  archive.value(t);
  before_ = Frame{view_at(t), {}, {}, {}};
  archive.sized_image(before_->depth);
  archive.sized_image(before_->object);
  archive.sized_image(before_->surface);
}

void OpticalFlowFromDepth::compute(const Frame& from, const RenderRequest& to, const Image<float>& depth_there) {
  const std::vector<SE3> T_there_here = motions(from.view, to);
  const std::vector<Eigen::Matrix3d> R_there_object = rotations(to);
  find_displacements(from, to.t);
  optical_flow_.t0 = from.view.t;
  optical_flow_.t1 = to.t;
  workers_.for_each(camera_.height, [&](int y) {
    for (int x = 0; x < camera_.width; ++x) {
      const std::size_t object = from.view.objects.empty() ? 0 : from.object(x, y);
      const SE3& motion = T_there_here[object];
      const Eigen::Vector2d& bearing = bearings_(x, y);
      const double nearness = 1.0 / double{from.depth(x, y)};  // 0 at infinity

      // The point divided by its depth: the scale does not affect the projection.
      Eigen::Vector3d there = motion.rotation * bearing.homogeneous() + nearness * motion.translation;
      if (!displacement_.empty()) there += nearness * (R_there_object[object] * displacement_(x, y).cast<double>());
      const auto image = camera_.project(there);
      optical_flow_.x(x, y) = image ? static_cast<float>(image->pixel.x() - x) : kNone;
      optical_flow_.y(x, y) = image ? static_cast<float>(image->pixel.y() - y) : kNone;
      const bool inside = image && image->pixel.x() >= -0.5 && image->pixel.x() < camera_.width - 0.5 &&
                          image->pixel.y() >= -0.5 && image->pixel.y() < camera_.height - 0.5;
      optical_flow_.visible(x, y) =
          inside && is_seen(depth_there, image->pixel.x(), image->pixel.y(), nearness / there.z()) ? 1 : 0;
    }
  });
}

void OpticalFlowFromDepth::find_displacements(const Frame& from, TimeNs to) {
  if (surfaces_ == nullptr) return;
  if (displacement_.empty()) displacement_ = Image<Eigen::Vector3f>(camera_.width, camera_.height);
  displacement_.fill(Eigen::Vector3f::Zero());
  std::vector<std::size_t> pixels;
  std::vector<SurfacePoint> points;
  for (std::size_t object = 1; object <= from.view.objects.size(); ++object) {
    if (surfaces_->triangle_count(object) == 0) continue;
    pixels.clear(), points.clear();
    const auto seen = from.object.pixels();
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i] == object) pixels.push_back(i), points.push_back(from.surface.pixels()[i]);
    }
    if (points.empty()) continue;
    std::vector<Eigen::Vector3f> before(points.size()), after(points.size());
    surfaces_->locate(object, from.view.t, points, before);
    surfaces_->locate(object, to, points, after);
    for (std::size_t i = 0; i < pixels.size(); ++i) displacement_.pixels()[pixels[i]] = after[i] - before[i];
  }
}

}  // namespace esim::inline truth

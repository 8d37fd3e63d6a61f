#include "esim/motion/files/image_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "esim/core/error.h"
#include "esim/geometry/reconstruction/colmap.h"
#include "esim/geometry/reconstruction/transforms.h"
#include "esim/motion/files/natural_order.h"

namespace esim::inline motion {
namespace {

/// An image of either format.
struct Image {
  std::string name;
  std::optional<double> time_s;
  SE3 T_world_camera;
};

std::vector<Image> read_images(const ReconstructionFile& file) {
  std::vector<Image> images;
  if (file.kind == ReconstructionKind::colmap) {
    for (ColmapImage& image : read_colmap_images(file.file))
      images.push_back({std::move(image.name), std::nullopt, image.T_camera_world.inverse()});
  } else {
    for (TransformsFrame& frame : read_transforms_frames(file.file))
      images.push_back({std::move(frame.file_path), frame.time_s, frame.T_world_camera});
  }
  return images;
}

/// Sorts by name, and sets the stamps; `fail` throws.
template <typename Fail>
void set_stamps(std::vector<Image>& images, double rate_hz, const Fail& fail) {
  std::ranges::sort(images, natural_less, &Image::name);
  if (images.front().name.empty())
    fail("a frame has neither file_path nor time, so that its place in the motion is unknown; add one of them");
  const auto same = std::ranges::adjacent_find(images, {}, &Image::name);
  if (same != images.end()) fail(fmt::format("image {} occurs twice; remove one of them", same->name));
  for (std::size_t i = 0; i < images.size(); ++i) images[i].time_s = static_cast<double>(i) / rate_hz;
}

}  // namespace

ImagePoses read_image_poses(const ReconstructionFile& file, double rate_hz) {
  const auto fail = [&](const std::string& message) {
    throw UserError(fmt::format("{}: {}", file.file.string(), message));
  };
  std::vector<Image> images = read_images(file);
  if (images.size() < 2) {
    fail(fmt::format("{} image{}, but a motion needs at least two; name another model or file", images.size(),
                     images.size() == 1 ? "" : "s"));
  }
  ImagePoses result;
  result.stamped = images.front().time_s.has_value();
  if (result.stamped) {
    std::ranges::stable_sort(images, {}, &Image::time_s);
  } else {
    set_stamps(images, rate_hz, fail);
  }
  constexpr double kMaxTime_s = 4e9;  // so that differences do not overflow
  for (const Image& image : images) {
    const double time_s = *image.time_s;
    if (!(std::abs(time_s) <= kMaxTime_s)) {
      fail(fmt::format("image {}: its time, {} s, must be within {} s; {}", image.name, time_s, kMaxTime_s,
                       result.stamped ? "times are in seconds" : "set a larger rate_hz"));
    }
    TimedPose pose{std::llround(time_s * 1e9), image.T_world_camera};
    if (!result.poses.empty() && result.poses.back().T_world_body.rotation.dot(pose.T_world_body.rotation) < 0.0)
      pose.T_world_body.rotation.coeffs() *= -1.0;
    result.poses.push_back(pose);
  }
  if (const auto fault = find_stamp_fault(result.poses))
    fail(fmt::format("image {}: {}", images[fault->pose].name, fault->message));
  return result;
}

std::optional<Eigen::Vector3d> mean_up(const std::vector<TimedPose>& poses) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const TimedPose& pose : poses) sum -= pose.T_world_body.rotation * Eigen::Vector3d::UnitY();
  constexpr double kMinMean = 0.1;  // below, the images have no common upper side
  if (sum.norm() < kMinMean * static_cast<double>(poses.size())) return std::nullopt;
  return sum.normalized();
}

}  // namespace esim::inline motion

#include "esim/evaluate/paper_scenario.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "esim/motion/random.h"

namespace esim::inline evaluate {
namespace {

constexpr double kDuration_s = 5, kPoses_hz = 250;

// From the panorama configuration of the original ESIM's release; the paper does not state it.
constexpr int kMedian_px = 5;

// Found by searching the first seeds: with these values, the motion has the paper's statistics.
constexpr std::uint64_t kSeed = 204;
constexpr double kKnotInterval_s = 0.5;
const Eigen::Vector3d kAmplitude_deg{20, 90, 90};
constexpr double kSpeed = 1.3649, kPeakSpeed = 1.4492, kPeak_s = 1.5, kPeakWidth_s = 0.06;

/// Time on the random motion at time t: the integral of kSpeed (1 + kPeakSpeed e^-((t - kPeak) / width)^2).
double progress_s(double t) {
  const double area = kPeakSpeed * kPeakWidth_s * std::sqrt(std::numbers::pi) / 2;
  return kSpeed * (t + area * (std::erf((t - kPeak_s) / kPeakWidth_s) + std::erf(kPeak_s / kPeakWidth_s)));
}

}  // namespace

std::string paper_rotation() {
  RandomMotionOptions motion;
  motion.rotation_amplitude_rad = kAmplitude_deg * std::numbers::pi / 180;
  motion.knot_interval_s = kKnotInterval_s;
  motion.center.rotation = looking_along(Eigen::Vector3d::UnitX());
  const SplineTrajectory path = random_trajectory(motion, 0, to_ns(progress_s(kDuration_s)) + 1, kSeed);
  std::string text = "# t [s], position [m], quaternion x y z w of the camera in the world\n";
  const int poses = static_cast<int>(kDuration_s * kPoses_hz);
  for (int k = 0; k <= poses; ++k) {
    const double t = k / kPoses_hz;
    const Eigen::Quaterniond q = path.at(to_ns(progress_s(t))).T_world_body.rotation;
    text += fmt::format("{:.3f} 0 0 0 {:.9f} {:.9f} {:.9f} {:.9f}\n", t, q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

Scenario paper_scenario(const std::filesystem::path& panorama, const std::filesystem::path& rotation) {
  Scenario scenario;
  PanoramaRendererOptions renderer;
  renderer.image = panorama;
  renderer.median_px = kMedian_px;
  scenario.renderer = renderer;
  FileTrajectoryOptions trajectory;
  trajectory.path = rotation;
  scenario.trajectory = trajectory;
  CameraOptions camera;
  camera.name = "cam0";
  camera.width = 346;
  camera.height = 260;
  camera.horizontal_fov_deg = 75;
  camera.event_camera.contrast_threshold = 0.3;
  scenario.cameras = {camera};
  return scenario;
}

}  // namespace esim::inline evaluate

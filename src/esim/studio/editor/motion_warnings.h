#pragma once

#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/geometry/kinematics.h"
#include "esim/scene/scene.h"

namespace esim::studio {

struct MotionSample {
  TimeNs t = 0;
  Kinematics body{};
};

/// A part of a motion that is probably unintended.
struct MotionWarning {
  TimeNs from = 0, to = 0;
  std::string what{};
};

/// Warns where the camera passes through a static surface, leaves the scene's bounds, or turns or accelerates faster
/// than a hand-held camera. Samples are in order of time; between two samples the camera moves along a straight line.
std::vector<MotionWarning> motion_warnings(const std::vector<MotionSample>& course, const SE3& T_body_camera,
                                           const Scene& scene);

}  // namespace esim::studio

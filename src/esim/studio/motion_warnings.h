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

/// Something about a motion that is probably not as meant.
struct MotionWarning {
  TimeNs from = 0, to = 0;
  std::string what{};
};

/// Where the camera passes through a surface that stands still, leaves the scene's bounds, or turns or accelerates as
/// nothing does that is held in a hand. Samples are in order of time; between two of them the camera goes straight.
std::vector<MotionWarning> motion_warnings(const std::vector<MotionSample>& course, const SE3& T_body_camera,
                                           const Scene& scene);

}  // namespace esim::studio

#pragma once

#include <memory>
#include <vector>

#include "esim/motion/fit.h"
#include "esim/motion/trajectory.h"

namespace esim::python {

/// A motion that Python holds, and what it was made of: the same poses and options make the same motion again.
struct SharedTrajectory {
  std::shared_ptr<const Trajectory> motion;
  FitReport fit;
  std::shared_ptr<const std::vector<TimedPose>> poses;
  FitOptions options;
};

}  // namespace esim::python

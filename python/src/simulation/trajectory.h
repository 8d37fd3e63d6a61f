#pragma once

#include <memory>
#include <vector>

#include "esim/motion/fit/fit.h"
#include "esim/motion/trajectory.h"

namespace esim::python {

/// A motion and its original poses and options, which reproduce the same motion.
struct SharedTrajectory {
  std::shared_ptr<const Trajectory> motion;
  FitReport fit;
  std::shared_ptr<const std::vector<TimedPose>> poses;
  FitOptions options;
};

}  // namespace esim::python

#pragma once

#include <memory>

#include "esim/motion/fit.h"
#include "esim/motion/trajectory.h"

namespace esim::python {

/// A motion that Python holds.
struct SharedTrajectory {
  std::shared_ptr<const Trajectory> motion;
  FitReport fit;
};

}  // namespace esim::python

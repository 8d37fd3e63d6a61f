#pragma once

#include <memory>

#include "esim/scene/deformation/deformation.h"

namespace esim::inline scene {

/// How an animation is played.
struct AnimationClock {
  TimeNs start = 0;       ///< when it begins; before, the shape rests
  double time_scale = 1;  ///< 2: takes twice as long
  TimeNs skipped = 0;     ///< what is left out at its beginning, in its own time
  bool repeats = false;   ///< begins again after its end, without a transition
};

/// The deformation at the times of a clock: at time t, it is that of its own time
/// span().start + skipped + (t - start) / time_scale, to the nanosecond.
std::shared_ptr<const Deformation> retimed(std::shared_ptr<const Deformation> deformation, const AnimationClock& clock);

/// The deformation with all coordinates multiplied by a positive factor.
std::shared_ptr<const Deformation> scaled(std::shared_ptr<const Deformation> deformation, double factor);

}  // namespace esim::inline scene

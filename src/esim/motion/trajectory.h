#pragma once

#include "esim/core/time.h"
#include "esim/geometry/kinematics.h"

namespace esim::inline motion {

/// A motion over the closed interval [start, end]. The result of at() for a time never changes; several threads may
/// call it.
class Trajectory {
 public:
  virtual ~Trajectory() = default;

  /// Throws InternalError for t outside [start, end].
  virtual Kinematics at(TimeNs t) const = 0;

  virtual TimeNs start() const = 0;
  virtual TimeNs end() const = 0;

 protected:
  /// Throws the InternalError that at() promises.
  void require_covered(TimeNs t) const;
};

}  // namespace esim::inline motion

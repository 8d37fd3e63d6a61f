#pragma once

#include "esim/compare/event_matching.h"
#include "esim/recording/format.h"

namespace esim::inline compare {

inline constexpr double kSurfaceTau_s = 0.03;

/// How far apart two recordings of the same scene and motion are, on one sensor and in one time.
struct SceneComparison {
  EventComparison events;  ///< of the second recording against the first
  /// Of exponential time surfaces (tau 30 ms) at 20 times: sum of |S1 - S2| over the sum of max(S1, S2). 0: equal, 1:
  /// no event in common. NaN without events.
  double surfaces = 0;
  /// Of voxel grids of 5 bins in windows of 50 ms: sum of |V1 - V2| over the sum of |V1| + |V2|. NaN without events.
  double voxels = 0;
  TimeSpan span;  ///< that both recordings cover
};

/// Compares the span of time that both cover. Events must be in order of time and on the sensor. Throws UserError if
/// the recordings do not overlap.
SceneComparison compare_scenes(EventSpan first, EventSpan second, const SensorSize& sensor);

/// The events with start <= t <= end.
EventSpan events_within(EventSpan events, const TimeSpan& span);

}  // namespace esim::inline compare

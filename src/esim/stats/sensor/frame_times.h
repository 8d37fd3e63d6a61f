#pragma once

#include <optional>

#include "esim/core/time.h"
#include "esim/events/event.h"

namespace esim::inline stats {

/// When a chip exposed frames that disturbed its event pixels (docs/methods/circuit.md, "Frames of the same chip"):
/// many OFF events of all pixels shortly after the start of each exposure, many ON events after its end. Times as those
/// of the events.
struct FrameTimes {
  std::optional<TimeNs> start, end;  ///< of one exposure; one of both may be unknown
  std::optional<TimeNs> period;      ///< of the frames, if more than one was found

  std::optional<TimeNs> exposure() const { return start && end ? std::optional(*end - *start) : std::nullopt; }
  /// The same times, counted from `moment`.
  FrameTimes since(TimeNs moment) const;
};

/// Finds frames by these bursts, in events in order of time, of seconds (2 MB per second). Empty if no burst is
/// certain, if bursts do not recur periodically, or if exposures differ.
std::optional<FrameTimes> find_frames(EventSpan events);

/// Events in the bursts of all frames, beyond those that the milliseconds before them let expect.
struct BurstEvents {
  double events = 0, deviation = 0;  ///< with the standard deviation of Poisson counts
};
BurstEvents count_burst_events(EventSpan events, const FrameTimes& frames);

}  // namespace esim::inline stats

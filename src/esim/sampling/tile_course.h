#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/random.h"
#include "esim/render/sample.h"
#include "esim/sampling/error_budget.h"
#include "esim/sampling/options.h"
#include "esim/sampling/tile_timeline.h"

namespace esim {

inline constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

/// Tiles whose motion is watched: those up to so many away.
inline constexpr int kReach = 3;

/// A tile on its way through time.
struct TileCourse {
  /// Why it asks for its next sample.
  enum class Reason { next, bisection, audit };

  TileCourse(const Tile& tile, float log_eps, TimeNs start) : timeline(tile, log_eps), due(start) {}

  TimeNs last() const { return timeline.time(timeline.size() - 1); }
  bool complete(TimeNs end) const { return timeline.size() > 0 && last() >= end; }

  TileTimeline timeline;
  std::size_t done = 0;  // index of the sample up to which segments have been given
  TimeNs due = 0;        // the next sample; kNever after the last
  Reason reason = Reason::next;
  TimeNs audited = std::numeric_limits<TimeNs>::min();  // intervals that begin up to then are not audited any more
  double step = 0;                                      // that was planned last, ns
  double speed = 0;                                     // fastest motion at the last sample, px/s
  // When what the tile showed last may come into a tile so many away; kNever where nothing moves.
  std::array<TimeNs, kReach + 1> arrival = {kNever, kNever, kNever, kNever};
  bool begun = false;  // the first segment, an instant, has been given

  // What the last sample brought.
  std::size_t until = 0;          // segments up to this sample are to be given
  std::vector<Segment> segments;  // that are given now
  double log_intervals = 0;       // lengths of the intervals that were given, ln ns added up
  int intervals = 0;
  std::int64_t held = 0;
  std::vector<float> audit;  // errors of the audited interval; empty for none
  float most_change = 0;     // of a pixel's brightness in it
  TimeNs audit_duration = 0;
};

/// Decides of each tile how far it is known well enough, and when it needs its next sample.
class TilePlanner {
 public:
  TilePlanner(const AdaptiveSampling& options, TimeSpan span);

  TimeNs shortest() const { return shortest_; }

  /// One row in so many of the motion field is looked at, from the image's first on.
  int motion_rows() const { return motion_rows_; }

  /// Takes the sample of a tile that was due; `index` is the tile's number among all.
  void take(TileCourse& tile, std::uint32_t index, const Sample& sample, const ErrorLimits& limits) const;

  /// The time `step` ns after the tile's last sample, or a little less, within the bounds.
  TimeNs after(const TileCourse& tile, double step) const;

 private:
  void audit(TileCourse& tile) const;
  void settle(TileCourse& tile, std::uint32_t index, const ErrorLimits& limits) const;
  void plan(TileCourse& tile, const ErrorLimits& limits) const;
  TimeNs middle(TimeNs t, TimeNs h) const;
  TimeNs on_grid(TimeNs t, TimeNs h) const;

  double max_motion_px_;
  TimeSpan span_;
  TimeNs shortest_, longest_;
  int motion_rows_;
  AddressedRandom random_;
};

}  // namespace esim

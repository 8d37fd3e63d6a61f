#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/random.h"
#include "esim/render/sample.h"
#include "esim/sampling/adaptive/error_budget.h"
#include "esim/sampling/adaptive/tile_timeline.h"
#include "esim/sampling/options.h"

namespace esim::inline sampling {

inline constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

/// Content is expected from tiles up to this distance, in tiles.
inline constexpr int kReach = 3;

/// The sampling state of a tile.
struct TileCourse {
  /// Reason of the next sample.
  enum class Reason { next, bisection, audit };

  TileCourse(const Tile& tile, float log_eps, TimeNs start) : timeline(tile, log_eps), due(start) {}

  /// What remains between two samples, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    TileTimeline::transfer(archive, self.timeline);
    archive.value(self.done);
    archive.value(self.due);
    archive.value(self.reason);
    archive.value(self.audited);
    archive.value(self.step);
    archive.value(self.speed);
    archive.value(self.arrival);
    archive.value(self.begun);
  }

  TimeNs last() const { return timeline.time(timeline.size() - 1); }
  bool complete(TimeNs end) const { return timeline.size() > 0 && last() >= end; }

  TileTimeline timeline;
  std::size_t done = 0;  // index of the sample up to which segments have been passed on
  TimeNs due = 0;        // the next sample; kNever after the last
  Reason reason = Reason::next;
  TimeNs audited = std::numeric_limits<TimeNs>::min();  // intervals that begin until then are no longer audited
  double step = 0;                                      // the last planned step, ns
  double speed = 0;                                     // fastest motion at the last sample, px/s
  // Time at which the tile's content may enter a tile at each distance; kNever if nothing moves.
  std::array<TimeNs, kReach + 1> arrival = {kNever, kNever, kNever, kNever};
  bool begun = false;  // the first segment, an instant, has been passed on

  // Result of the last sample.
  std::size_t until = 0;          // pass on the segments up to this sample
  std::vector<Segment> segments;  // to pass on now
  double log_intervals = 0;       // of the intervals passed on: sum of ln ns
  int intervals = 0;
  std::int64_t held = 0;
  std::vector<float> audit;  // errors of the audited interval; empty without an audit
  float most_change = 0;     // of a pixel's brightness in it
  TimeNs audit_duration = 0;
};

/// Decides up to which time a tile is known accurately enough, and when it needs its next sample.
class TilePlanner {
 public:
  TilePlanner(const AdaptiveSampling& options, TimeSpan span);

  TimeNs shortest() const { return shortest_; }

  /// Every motion_rows()-th row of the motion field is used, from the image's first on.
  int motion_rows() const { return motion_rows_; }

  /// Takes the tile's sample that was due; `index` is the number of the tile.
  void take(TileCourse& tile, std::uint32_t index, const Sample& sample, const ErrorLimits& limits) const;

  /// The time `step` ns after the tile's last sample, or slightly earlier, within the bounds.
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

}  // namespace esim::inline sampling

#include "esim/sampling/adaptive/tile_course.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace esim::inline sampling {
namespace {

// One in kAuditOneIn intervals is audited.
constexpr std::uint32_t kAuditOneIn = 128;

// Planned error of the next interval, as a fraction of the permitted error.
constexpr double kAim = 0.65;

// Every kMotionRows-th row of the motion field, which is smooth, is used, including the first row of each tile.
constexpr int kMotionRows = 4;

// Times are multiples of a power of two, at most this fraction of the interval: so tiles share times.
constexpr double kGrid = 0.03125;

/// Fastest finite motion in some rows of a tile, px/s.
double fastest_in(const Sample& sample, const Tile& tile, int every) {
  float most = 0;
  for (int y = tile.y; y < tile.y + tile.height; y += every) {
    const float *const vx = sample.motion_x.row(y) + tile.x, *const vy = sample.motion_y.row(y) + tile.x;
#pragma omp simd reduction(max : most)
    for (int x = 0; x < tile.width; ++x) {
      const float v2 = vx[x] * vx[x] + vy[x] * vy[x];
      most = v2 > most && v2 <= std::numeric_limits<float>::max() ? v2 : most;
    }
  }
  return std::sqrt(static_cast<double>(most));
}

/// Predicted energy of the interval between samples i and i + 1: mean square error times duration. It follows from the
/// prediction errors of both samples, which belong to longer intervals: errors are proportional to the square of the
/// length.
double error_energy(const TileTimeline& timeline, std::size_t i) {
  const auto h = static_cast<double>(timeline.time(i + 1) - timeline.time(i));
  double most = 0;
  for (const std::size_t k : {i, i + 1}) {
    if (k == 0 || k + 1 >= timeline.size()) continue;
    const auto left = static_cast<double>(timeline.time(k) - timeline.time(k - 1));
    const auto right = static_cast<double>(timeline.time(k + 1) - timeline.time(k));
    most = std::max(most, timeline.surprise(k) * std::min(1.0, h * h / (4 * left * right)));
  }
  return most * most * h;
}

}  // namespace

TilePlanner::TilePlanner(const AdaptiveSampling& options, TimeSpan span)
    : max_motion_px_(options.max_motion_px),
      span_(span),
      shortest_(std::max<TimeNs>(1, to_ns(1.0 / options.bounds.max_rate_hz))),
      longest_(std::max(shortest_, to_ns(1.0 / options.bounds.min_rate_hz))),
      motion_rows_(options.tile_px % kMotionRows == 0 ? kMotionRows : 1),
      random_(0, Purpose::sampling_audit) {}

void TilePlanner::take(TileCourse& tile, std::uint32_t index, const Sample& sample, const ErrorLimits& limits) const {
  tile.timeline.insert(tile.due, sample.irradiance);
  if (tile.reason == TileCourse::Reason::audit) audit(tile);
  if (tile.reason == TileCourse::Reason::next) tile.speed = fastest_in(sample, tile.timeline.tile(), motion_rows_);
  settle(tile, index, limits);
}

/// Measures the error of the audited interval with the sample that was taken for the audit.
void TilePlanner::audit(TileCourse& tile) const {
  const TileTimeline& timeline = tile.timeline;
  std::size_t i = tile.done;
  while (timeline.time(i) != tile.due) ++i;
  timeline.errors(i, tile.audit);
  tile.audit_duration = timeline.time(i + 1) - timeline.time(i - 1);
  const auto l0 = timeline.brightness(i - 1), l1 = timeline.brightness(i), l2 = timeline.brightness(i + 1);
  tile.most_change = 0;
  for (std::size_t k = 0; k < l1.size(); ++k) {
    const float change = std::max({l0[k], l1[k], l2[k]}) - std::min({l0[k], l1[k], l2[k]});
    tile.most_change = std::max(tile.most_change, change);
  }
}

/// Finds up to which sample the tile is known accurately enough, and its next sample.
void TilePlanner::settle(TileCourse& tile, std::uint32_t index, const ErrorLimits& limits) const {
  const TileTimeline& timeline = tile.timeline;
  const bool complete = tile.complete(span_.end);
  tile.until = tile.done;
  for (std::size_t i = tile.done; i + 1 < timeline.size(); ++i) {
    if (i + 2 >= timeline.size() && !complete) break;  // the sample after it is needed to judge it
    const TimeNs t0 = timeline.time(i), h = timeline.time(i + 1) - t0;
    const bool too_much = error_energy(timeline, i) > limits.energy;
    if (too_much && h >= 2 * shortest_) {
      tile.reason = TileCourse::Reason::bisection, tile.due = middle(t0, h);
      return;
    }
    if (too_much) ++tile.held;
    const auto draw = static_cast<std::uint64_t>(t0 - span_.start);
    if (t0 > tile.audited && h >= 2 * shortest_ && i > 0 && random_.bits(index, draw)[0] % kAuditOneIn == 0) {
      tile.reason = TileCourse::Reason::audit, tile.due = middle(t0, h);
      tile.audited = timeline.time(i + 1) - 1;
      return;
    }
    tile.until = i + 1;
  }
  tile.reason = TileCourse::Reason::next;
  if (complete) {
    tile.due = kNever;
  } else {
    plan(tile, limits);
  }
}

/// Chooses the time of the tile's next sample.
void TilePlanner::plan(TileCourse& tile, const ErrorLimits& limits) const {
  const TileTimeline& timeline = tile.timeline;
  const std::size_t last = timeline.size() - 1;
  const double way = max_motion_px_ / tile.speed * 1e9;  // ns
  // Initially nothing is known: start with short steps.
  double step = 0.25 * std::min({way, static_cast<double>(longest_), static_cast<double>(span_.end - span_.start)});
  if (last >= 2) {
    const auto left = static_cast<double>(timeline.time(last - 1) - timeline.time(last - 2));
    const auto right = static_cast<double>(timeline.time(last) - timeline.time(last - 1));
    // The energy is proportional to the fifth power of the length.
    const double square =
        timeline.surprise(last - 1) * timeline.surprise(last - 1) / (16 * left * left * right * right);
    step = std::pow(kAim * kAim * limits.energy / std::max(square, 1e-300), 0.2);
    // Bisections do not predict the future: limit the change relative to the previous step.
    step = std::clamp(step, 0.5 * tile.step, 2 * tile.step);
  }
  tile.step = std::clamp(step, static_cast<double>(shortest_), static_cast<double>(longest_));
  tile.due = after(tile, std::min(step, way));
}

TimeNs TilePlanner::after(const TileCourse& tile, double step) const {
  const auto h = std::clamp(static_cast<TimeNs>(std::min(step, 1e18)), shortest_, longest_);
  return std::min(std::max(on_grid(tile.last() + h, h), tile.last() + shortest_), span_.end);
}

/// A time in the middle of [t, t + h], or slightly earlier.
TimeNs TilePlanner::middle(TimeNs t, TimeNs h) const { return std::max(on_grid(t + h / 2, h), t + h / 4); }

/// The last time <= t that is a multiple of the largest power of two within kGrid h.
TimeNs TilePlanner::on_grid(TimeNs t, TimeNs h) const {
  const auto grid = std::bit_floor(static_cast<std::uint64_t>(std::max(1.0, kGrid * static_cast<double>(h))));
  const TimeNs since = t - span_.start;
  return t - since % static_cast<TimeNs>(grid);
}

}  // namespace esim::inline sampling

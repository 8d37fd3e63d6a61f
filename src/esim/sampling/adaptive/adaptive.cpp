#include "esim/sampling/adaptive/adaptive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <utility>
#include <vector>

#include "esim/core/large_vector.h"
#include "esim/sampling/adaptive/error_budget.h"
#include "esim/sampling/adaptive/tile_course.h"

namespace esim::inline sampling {
namespace {

using Reason = TileCourse::Reason;

// A round takes the tiles that are due within this fraction of the typical interval.
constexpr double kRound = 0.5;

// In a round, tiles are sampled at the same time if none is sampled earlier than it is due by more than this fraction
// of its interval: each different time has a cost.
constexpr double kSlack = 0.06;

// The curvature term of an interval is omitted if it is below this fraction of the tolerance.
constexpr double kStraight = 0.07;

// Tiles per task of a parallel loop: a round has a few tens of tiles.
constexpr int kTogether = 4;

/// Memory for the pixels of tiles: several threads take blocks, which are all returned together.
class TileMemory {
 public:
  explicit TileMemory(std::size_t pixels) : pixels_(pixels) {}

  float* take() {
    const std::lock_guard lock(mutex_);
    if (taken_ == blocks_.size()) blocks_.emplace_back(pixels_);
    return blocks_[taken_++].data();
  }
  void take_back() { taken_ = 0; }

 private:
  std::size_t pixels_, taken_ = 0;
  std::vector<LargeVector<float>> blocks_;
  std::mutex mutex_;
};

class AdaptiveSampler final : public Sampler {
 public:
  AdaptiveSampler(const AdaptiveSampling& options, const SamplingContext& context)
      : options_(options),
        context_(context),
        columns_((context.width + options.tile_px - 1) / options.tile_px),
        rows_((context.height + options.tile_px - 1) / options.tile_px),
        planner_(options, context.span),
        between_(static_cast<std::size_t>(options.tile_px) * static_cast<std::size_t>(options.tile_px)),
        budget_(options.tolerance * context.sensor.contrast_threshold) {
    statistics_.tolerance = options.tolerance;
    const auto eps = static_cast<float>(context.sensor.log_eps);
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const int x = column * options.tile_px, y = row * options.tile_px;
        const int width = std::min(options.tile_px, context.width - x);
        tiles_.emplace_back(Tile{x, y, width, std::min(options.tile_px, context.height - y)}, eps, context.span.start);
      }
    }
    request();
  }

  const SampleRequest* next() const override { return asked_.empty() ? nullptr : &request_; }

  std::span<const Segment> accept(Sample& sample) override {
    ++statistics_.samples;
    for (const Tile& tile : sample.tiles) statistics_.pixel_evaluations += static_cast<std::int64_t>(tile.area());
    const ErrorLimits limits = budget_.limits();
    straight_ = kStraight * limits.error;
    between_.take_back();
    for_each(asked_, [&](TileCourse& tile, std::uint32_t index) {
      planner_.take(tile, index, sample, limits);
      give(tile);
    });
    account();
    collect();
    if (!asked_.empty()) watch();
    request();
    return segments_;
  }

  std::span<const Segment> more() override { return {}; }

  TimeNs watermark() const override {
    TimeNs known = context_.span.end;
    for (const TileCourse& tile : tiles_)
      known = std::min(known, tile.timeline.size() > 0 ? tile.timeline.time(tile.done) : context_.span.start);
    return known;
  }

  SamplingStatistics statistics() const override { return statistics_; }

  void save(StateWriter& archive) const override { transfer(archive, *this); }
  void restore(StateReader& archive) override { transfer(archive, *this); }

 private:
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.objects(self.tiles_, [](auto& a, auto& tile) { TileCourse::transfer(a, tile); });
    archive.value(self.request_.t);
    archive.list(self.request_.tiles);
    archive.value(self.request_.motion_rows);
    archive.objects(self.request_.later, [](auto& a, auto& at) {
      a.value(at.t);
      a.list(at.tiles);
    });
    archive.list(self.asked_);
    archive.value(self.budget_);
    transfer_statistics(archive, self.statistics_);
  }

  /// Calls body(tile, index) for some of the tiles in parallel.
  template <typename Body>
  void for_each(const std::vector<std::uint32_t>& indices, const Body& body) {
    const auto count = static_cast<int>(indices.size());
    context_.workers.for_each((count + kTogether - 1) / kTogether, [&](int piece) {
      const int end = std::min(count, (piece + 1) * kTogether);
      for (int i = piece * kTogether; i < end; ++i) {
        const std::uint32_t* const index = indices.data() + i;
        if (i + 1 < end) tiles_[index[1]].timeline.prefetch();  // only of this task: others may be changing
        body(tiles_[*index], *index);
      }
    });
  }

  void give(TileCourse& tile);
  int pieces(const TileTimeline& timeline, std::size_t i) const;
  void account();
  void collect();
  void watch();
  void request();
  void choose_round();
  void meet();

  AdaptiveSampling options_;
  SamplingContext context_;
  int columns_, rows_;
  TilePlanner planner_;

  std::vector<TileCourse> tiles_;
  SampleRequest request_;
  std::vector<std::uint32_t> asked_;  // tiles of the request

  TileMemory between_;  // irradiance between samples
  std::vector<Segment> segments_;

  ErrorBudget budget_;
  double straight_ = 0;  // curvature that is omitted, ln units
  SamplingStatistics statistics_;
};

/// Makes a tile's segments from the intervals that are known accurately enough.
void AdaptiveSampler::give(TileCourse& tile) {
  TileTimeline& timeline = tile.timeline;
  tile.segments.clear();
  const ImageView<float> start(timeline.irradiance(tile.done), timeline.tile());
  if (!std::exchange(tile.begun, true)) {
    tile.segments.push_back({timeline.tile(), timeline.time(0), timeline.time(0), start, start});
  }
  for (std::size_t i = tile.done; i < tile.until; ++i) {
    const TimeNs t0 = timeline.time(i), h = timeline.time(i + 1) - t0;
    const int count = pieces(timeline, i);
    std::array<const float*, 5> ends = {timeline.irradiance(i)};
    if (count == 2) {
      float* const half = between_.take();
      timeline.write_half(i, half);
      ends[1] = half;
    } else if (count == 4) {
      const std::array<float*, 3> quarters = {between_.take(), between_.take(), between_.take()};
      timeline.write_quarters(i, quarters);
      std::copy(quarters.begin(), quarters.end(), ends.begin() + 1);
    }
    ends[static_cast<std::size_t>(count)] = timeline.irradiance(i + 1);
    for (int k = 0; k < count; ++k) {
      const auto end = ends.begin() + k;
      tile.segments.push_back({timeline.tile(),
                               t0 + h * k / count,
                               t0 + h * (k + 1) / count,
                               {end[0], timeline.tile()},
                               {end[1], timeline.tile()}});
    }
    tile.log_intervals += std::log(static_cast<double>(h)), ++tile.intervals;
  }
  tile.done = timeline.forget_before(tile.until);
}

/// Number of straight pieces into which the interval after sample i is divided.
int AdaptiveSampler::pieces(const TileTimeline& timeline, std::size_t i) const {
  constexpr TimeNs kMost = 4;
  if (timeline.time(i + 1) - timeline.time(i) < kMost) return 1;
  const double curvature = timeline.curvature(i);
  return curvature <= straight_ ? 1 : (curvature <= 4 * straight_ ? 2 : kMost);
}

/// Adds the results of the tiles to the statistics.
void AdaptiveSampler::account() {
  for (const std::uint32_t index : asked_) {
    TileCourse& tile = tiles_[index];
    statistics_.held_to_max_rate += std::exchange(tile.held, 0);
    budget_.remember(std::exchange(tile.log_intervals, 0), std::exchange(tile.intervals, 0));
    // First steps are a quarter of the expected interval.
    if (tile.timeline.size() == 1) budget_.remember(std::log(4 * tile.step), 1);
    if (tile.audit.empty()) continue;
    budget_.audit(tile.audit, tile.most_change, static_cast<double>(tile.audit_duration));
    statistics_.measured_error = budget_.measured();
    tile.audit.clear();
  }
}

/// Joins the segments of the tiles.
void AdaptiveSampler::collect() {
  segments_.clear();
  for (const std::uint32_t index : asked_) {
    const TileCourse& tile = tiles_[index];
    segments_.insert(segments_.end(), tile.segments.begin(), tile.segments.end());
  }
}

/// Makes tiles due earlier if content of other tiles may enter them.
void AdaptiveSampler::watch() {
  // Gap in px to a tile at this distance in tiles.
  const auto gap = [&](int distance) { return static_cast<double>(options_.tile_px * std::max(distance - 1, 0)); };
  const auto bring_forward = [&](TileCourse& tile, TimeNs t) {
    if (tile.reason != Reason::next || t >= tile.due) return;
    tile.due = planner_.after(tile, static_cast<double>(std::max<TimeNs>(t - tile.last(), 0)));
  };
  for (const std::uint32_t index : asked_) {
    TileCourse& tile = tiles_[index];
    for (int distance = 0; distance <= kReach; ++distance) {
      const double way = gap(distance) + options_.max_motion_px;
      tile.arrival[static_cast<std::size_t>(distance)] =
          tile.speed > 0 ? tile.last() + static_cast<TimeNs>(std::min(way / tile.speed * 1e9, 1e18)) : kNever;
    }
  }
  for (const std::uint32_t index : asked_) {
    TileCourse& own = tiles_[index];
    const int column = static_cast<int>(index) % columns_, row = static_cast<int>(index) / columns_;
    TimeNs first = kNever;
    for (int y = std::max(row - kReach, 0); y <= std::min(row + kReach, rows_ - 1); ++y) {
      for (int x = std::max(column - kReach, 0); x <= std::min(column + kReach, columns_ - 1); ++x) {
        TileCourse& other = tiles_[static_cast<std::size_t>(y * columns_ + x)];
        const auto distance = static_cast<std::size_t>(std::max(std::abs(x - column), std::abs(y - row)));
        if (other.due != kNever) bring_forward(other, own.arrival[distance]);
        first = std::min(first, other.arrival[distance]);
      }
    }
    if (own.due != kNever) bring_forward(own, first);
  }
}

/// Chooses the tiles of the next round: those with the earliest next samples, and all bisections and audits.
void AdaptiveSampler::choose_round() {
  TimeNs first = kNever;
  for (const TileCourse& tile : tiles_) {
    if (tile.reason == Reason::next) first = std::min(first, tile.due);
  }
  const auto span = static_cast<TimeNs>(std::min(kRound * budget_.typical_interval(), 1e18));
  asked_.clear();
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    if (tiles_[i].due == kNever || (tiles_[i].reason == Reason::next && tiles_[i].due - first > span)) continue;
    asked_.push_back(static_cast<std::uint32_t>(i));
  }
  const auto order = [&](std::uint32_t i) { return std::pair(tiles_[i].due, i); };
  std::sort(asked_.begin(), asked_.end(), [&](std::uint32_t a, std::uint32_t b) { return order(a) < order(b); });
}

/// Makes tiles of the round that are due at nearly the same time due at the same time.
void AdaptiveSampler::meet() {
  TimeNs t = kNever;
  for (const std::uint32_t index : asked_) {
    TileCourse& tile = tiles_[index];
    const bool early = tile.reason == Reason::next && tile.timeline.size() > 0 && t != kNever &&
                       t - tile.last() >= planner_.shortest() &&
                       static_cast<double>(tile.due - t) <= kSlack * static_cast<double>(tile.due - tile.last());
    if (early) tile.due = t;
    t = tile.due;
  }
}

/// Requests the tiles of the next round.
void AdaptiveSampler::request() {
  choose_round();
  meet();
  request_ = {};
  std::vector<TilesAt> times;
  for (const std::uint32_t index : asked_) {
    const TileCourse& tile = tiles_[index];
    if (times.empty() || times.back().t != tile.due) times.push_back({tile.due, {}});
    times.back().tiles.push_back(tile.timeline.tile());
    if (tile.reason == Reason::bisection) ++statistics_.bisections;
    if (tile.reason == Reason::audit) ++statistics_.audits;
  }
  if (times.empty()) return;
  request_.t = times.front().t;
  request_.tiles = std::move(times.front().tiles);
  times.erase(times.begin());
  request_.motion_rows = planner_.motion_rows();
  request_.later = std::move(times);
  std::sort(asked_.begin(), asked_.end());  // in the order of memory
}

}  // namespace

std::unique_ptr<Sampler> make_adaptive_sampler(const AdaptiveSampling& options, const SamplingContext& context) {
  return std::make_unique<AdaptiveSampler>(options, context);
}

}  // namespace esim::inline sampling

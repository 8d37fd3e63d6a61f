#include "esim/sampling/adaptive.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "esim/core/random.h"
#include "esim/sampling/error_budget.h"
#include "esim/sampling/tile_timeline.h"

namespace esim {
namespace {

constexpr double kNsPerS = 1e9;
constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max(), kLongAgo = std::numeric_limits<TimeNs>::min();

// One interval in so many is looked into.
constexpr std::uint32_t kAuditOneIn = 64;

// The next sample is meant to make this share of the error that is let pass.
constexpr double kAim = 0.6;

// Tiles are sampled together if none comes earlier than it should by more than this share of its interval.
constexpr double kSlack = 0.1;

// Times are multiples of a power of two, at most this share of the interval that they end: so tiles meet.
constexpr double kGrid = 0.03125;

// Tiles whose motion is watched: those up to so many away.
constexpr int kReach = 3;

/// Fastest finite motion in a tile, px/s.
float fastest_in(const Sample& sample, const Tile& tile) {
  float most = 0;
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const float *const vx = sample.flow_x.row(y) + tile.x, *const vy = sample.flow_y.row(y) + tile.x;
#pragma omp simd reduction(max : most)
    for (int x = 0; x < tile.width; ++x) {
      const float v2 = vx[x] * vx[x] + vy[x] * vy[x];
      most = v2 > most && v2 <= std::numeric_limits<float>::max() ? v2 : most;
    }
  }
  return std::sqrt(most);
}

/// Why a tile asks for its next sample.
enum class Reason { next, bisection, audit };

/// A tile on its way through time.
struct TileState {
  TileState(const Tile& tile, float log_eps) : timeline(tile, log_eps) {}

  TileTimeline timeline;
  std::size_t done = 0;  // index of the sample up to which segments have been given
  TimeNs due = 0;
  Reason reason = Reason::next;
  TimeNs audited = kLongAgo;  // intervals that begin up to then are not audited any more
  double step = 0;            // that was planned last, ns
  double speed = 0;           // fastest motion at the last sample, px/s
  bool begun = false;         // the first segment, an instant, has been given

  // What the last sample brought.
  std::size_t until = 0;    // segments up to this sample are to be given
  std::vector<int> pieces;  // into which each interval until there is cut
  std::int64_t held = 0;
  std::vector<float> audit;  // errors of the audited interval; empty for none
  float most_change = 0;     // of a pixel's brightness in it
  TimeNs audit_duration = 0;
};

class AdaptiveSampler final : public Sampler {
 public:
  AdaptiveSampler(const AdaptiveSampling& options, const SamplingContext& context)
      : options_(options),
        context_(context),
        shortest_(std::max<TimeNs>(1, to_ns(1.0 / options.bounds.max_rate_hz))),
        longest_(std::max(shortest_, to_ns(1.0 / options.bounds.min_rate_hz))),
        columns_((context.width + options.tile_px - 1) / options.tile_px),
        rows_((context.height + options.tile_px - 1) / options.tile_px),
        random_(0, Purpose::sampling_audit),
        budget_(options.tolerance * context.sensor.contrast_threshold),
        watermark_(context.span.start) {
    statistics_.tolerance = options.tolerance;
    const auto eps = static_cast<float>(context.sensor.log_eps);
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const int x = column * options.tile_px, y = row * options.tile_px;
        tiles_.emplace_back(
            Tile{x, y, std::min(options.tile_px, context.width - x), std::min(options.tile_px, context.height - y)},
            eps);
        tiles_.back().due = context.span.start;
      }
    }
    request();
  }

  const SampleRequest* next() const override { return asked_.empty() ? nullptr : &request_; }

  std::span<const Segment> accept(Sample& sample) override {
    ++statistics_.samples;
    for (const Tile& tile : sample.tiles) statistics_.pixel_evaluations += static_cast<std::int64_t>(tile.area());
    const auto count = static_cast<int>(asked_.size());
    constexpr int kTogether = 2;
    const auto each = [&](const auto& body) {
      context_.workers.for_each((count + kTogether - 1) / kTogether, [&](int piece) {
        for (int i = piece * kTogether; i < std::min(count, (piece + 1) * kTogether); ++i)
          body(static_cast<std::size_t>(i));
      });
    };
    each([&](std::size_t i) { take(tiles_[asked_[i]], asked_[i], sample); });
    account();
    lay_out();
    each([&](std::size_t i) { give(tiles_[asked_[i]], first_segment_[i]); });
    if (!asked_.empty()) watch();
    request();
    return segments_;
  }

  std::span<const Segment> more() override { return {}; }
  TimeNs watermark() const override { return watermark_; }
  SamplingStatistics statistics() const override { return statistics_; }

 private:
  void take(TileState& tile, std::uint32_t index, const Sample& sample);
  void audit(TileState& tile, TimeNs t) const;
  void settle(TileState& tile, std::uint32_t index) const;
  double error_energy(const TileTimeline& timeline, std::size_t i) const;
  void plan(TileState& tile) const;
  TimeNs after(const TileState& tile, double step) const;

  TimeNs middle(TimeNs t, TimeNs h) const;
  TimeNs on_grid(TimeNs t, TimeNs h) const;

  void account();
  int pieces(const TileTimeline& timeline, std::size_t i) const;
  void lay_out();
  void give(TileState& tile, std::size_t first);
  void watch();
  void request();
  bool nearly_due(const TileState& tile, TimeNs t) const;

  AdaptiveSampling options_;
  SamplingContext context_;
  TimeNs shortest_, longest_;
  int columns_, rows_;
  AddressedRandom random_;

  std::vector<TileState> tiles_;
  SampleRequest request_;
  std::vector<std::uint32_t> asked_;  // tiles of the request

  std::vector<Image<float>> layers_;  // irradiance at the ends of segments: of each tile, one after the other
  std::vector<Segment> segments_;
  std::vector<std::size_t> first_segment_;  // of each tile that was asked for

  ErrorBudget budget_;
  TimeNs watermark_;
  SamplingStatistics statistics_;
};

/// Takes a tile's new sample, and decides how far the tile is known and what it needs next.
void AdaptiveSampler::take(TileState& tile, std::uint32_t index, const Sample& sample) {
  const bool ahead = tile.reason == Reason::next;
  tile.timeline.insert(sample.t, sample.irradiance);
  if (tile.reason == Reason::audit) audit(tile, sample.t);
  if (ahead) tile.speed = fastest_in(sample, tile.timeline.tile());
  settle(tile, index);
  tile.pieces.clear();
  for (std::size_t i = tile.done; i < tile.until; ++i) tile.pieces.push_back(pieces(tile.timeline, i));
}

/// Looks what the error of the audited interval was: the sample at t was taken for that.
void AdaptiveSampler::audit(TileState& tile, TimeNs t) const {
  const TileTimeline& timeline = tile.timeline;
  std::size_t i = tile.done;
  while (timeline.time(i) != t) ++i;
  timeline.errors(i, tile.audit);
  tile.audit_duration = timeline.time(i + 1) - timeline.time(i - 1);
  const std::vector<float>&l0 = timeline.brightness(i - 1), &l1 = timeline.brightness(i),
        &l2 = timeline.brightness(i + 1);
  tile.most_change = 0;
  for (std::size_t k = 0; k < l1.size(); ++k) {
    const float change = std::max({l0[k], l1[k], l2[k]}) - std::min({l0[k], l1[k], l2[k]});
    tile.most_change = std::max(tile.most_change, change);
  }
}

/// The mean square error between samples i and i + 1 times its duration, as far as their own surprises tell, which
/// belong to longer intervals: errors go with the second power of the length.
double AdaptiveSampler::error_energy(const TileTimeline& timeline, std::size_t i) const {
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

/// Finds how far the tile is known well enough, and its next sample.
void AdaptiveSampler::settle(TileState& tile, std::uint32_t index) const {
  const TileTimeline& timeline = tile.timeline;
  const bool complete = timeline.time(timeline.size() - 1) >= context_.span.end;
  tile.until = tile.done;
  for (std::size_t i = tile.done; i + 1 < timeline.size(); ++i) {
    if (i + 2 >= timeline.size() && !complete) break;  // what comes behind is needed to judge it
    const TimeNs t0 = timeline.time(i), h = timeline.time(i + 1) - t0;
    const bool too_much = error_energy(timeline, i) > budget_.most_energy();
    if (too_much && h >= 2 * shortest_) {
      tile.reason = Reason::bisection, tile.due = middle(t0, h);
      return;
    }
    if (too_much) ++tile.held;
    const auto draw = static_cast<std::uint64_t>(t0 - context_.span.start);
    if (t0 > tile.audited && h >= 2 * shortest_ && i > 0 && random_.bits(index, draw)[0] % kAuditOneIn == 0) {
      tile.reason = Reason::audit, tile.due = middle(t0, h);
      tile.audited = timeline.time(i + 1) - 1;
      return;
    }
    tile.until = i + 1;
  }
  tile.reason = Reason::next;
  if (complete) {
    tile.due = kNever;
  } else {
    plan(tile);
  }
}

/// Chooses the time of the tile's next sample.
void AdaptiveSampler::plan(TileState& tile) const {
  const TileTimeline& timeline = tile.timeline;
  const std::size_t last = timeline.size() - 1;
  const double way = options_.max_motion_px / tile.speed * kNsPerS;  // ns
  // At first nothing is known: short steps tell something soon.
  double step = 0.25 * std::min({way, static_cast<double>(longest_),
                                 static_cast<double>(context_.span.end - context_.span.start)});
  if (last >= 2) {
    const auto left = static_cast<double>(timeline.time(last - 1) - timeline.time(last - 2));
    const auto right = static_cast<double>(timeline.time(last) - timeline.time(last - 1));
    // The energy goes with the fifth power of the length.
    const double square =
        timeline.surprise(last - 1) * timeline.surprise(last - 1) / (16 * left * left * right * right);
    step = std::pow(kAim * kAim * budget_.most_energy() / std::max(square, 1e-300), 0.2);
    // Bisections say nothing of what comes: steps change with the steps before.
    step = std::clamp(step, 0.5 * tile.step, 2 * tile.step);
  }
  tile.step = std::clamp(step, static_cast<double>(shortest_), static_cast<double>(longest_));
  tile.due = after(tile, std::min(step, way));
}

/// The time `step` ns after the tile's last sample, or a little less, within the bounds.
TimeNs AdaptiveSampler::after(const TileState& tile, double step) const {
  const auto h = std::clamp(static_cast<TimeNs>(std::min(step, 1e18)), shortest_, longest_);
  const TimeNs last = tile.timeline.time(tile.timeline.size() - 1);
  return std::min(std::max(on_grid(last + h, h), last + shortest_), context_.span.end);
}

/// A time in the middle of the h from t on, or a little before.
TimeNs AdaptiveSampler::middle(TimeNs t, TimeNs h) const { return std::max(on_grid(t + h / 2, h), t + h / 4); }

/// The last time not after t that is a multiple of the largest power of two within kGrid of h.
TimeNs AdaptiveSampler::on_grid(TimeNs t, TimeNs h) const {
  const auto grid = std::bit_floor(static_cast<std::uint64_t>(std::max(1.0, kGrid * static_cast<double>(h))));
  const TimeNs since = t - context_.span.start;
  return t - since % static_cast<TimeNs>(grid);
}

/// Adds up what the tiles found.
void AdaptiveSampler::account() {
  for (const std::uint32_t index : asked_) {
    TileState& tile = tiles_[index];
    statistics_.held_to_max_rate += std::exchange(tile.held, 0);
    for (std::size_t i = tile.done; i < tile.until; ++i)
      budget_.remember(static_cast<double>(tile.timeline.time(i + 1) - tile.timeline.time(i)));
    if (!tile.begun) budget_.remember(4 * tile.step);  // first steps are shorter than what is wanted
    if (tile.audit.empty()) continue;
    budget_.audit(tile.audit, tile.most_change, static_cast<double>(tile.audit_duration));
    statistics_.measured_error = budget_.measured();
    tile.audit.clear();
  }
}

/// Into how many straight pieces the interval behind sample i is cut for the pixels.
int AdaptiveSampler::pieces(const TileTimeline& timeline, std::size_t i) const {
  constexpr TimeNs kMost = 4;
  if (timeline.time(i + 1) - timeline.time(i) < kMost) return 1;
  const double bow = timeline.bow(i), straight = 0.05 * budget_.limit();
  return bow <= straight ? 1 : (bow <= 4 * straight ? 2 : kMost);
}

/// Makes the list of the segments to give.
void AdaptiveSampler::lay_out() {
  segments_.clear();
  first_segment_.clear();
  std::size_t layers = 0;
  for (const std::uint32_t index : asked_) {
    const TileState& tile = tiles_[index];
    const TileTimeline& timeline = tile.timeline;
    first_segment_.push_back(segments_.size());
    if (!tile.begun) segments_.push_back({timeline.tile(), timeline.time(0), timeline.time(0), nullptr, nullptr});
    for (std::size_t i = tile.done; i < tile.until; ++i) {
      const TimeNs t0 = timeline.time(i), h = timeline.time(i + 1) - t0;
      const int count = tile.pieces[i - tile.done];
      for (int k = 0; k < count; ++k)
        segments_.push_back({timeline.tile(), t0 + h * k / count, t0 + h * (k + 1) / count, nullptr, nullptr});
    }
    layers = std::max(layers, segments_.size() - first_segment_.back() + 1);
  }
  while (layers_.size() < layers) layers_.emplace_back(context_.width, context_.height);
}

/// Fills in the irradiance of a tile's segments, of which the first is given.
void AdaptiveSampler::give(TileState& tile, std::size_t first) {
  TileTimeline& timeline = tile.timeline;
  Image<float>* layer = layers_.data();
  Segment* segment = segments_.data() + first;
  timeline.write(tile.done, *layer);
  if (!std::exchange(tile.begun, true)) {
    segment->irradiance0 = segment->irradiance1 = layer;
    ++segment;
  }
  for (std::size_t i = tile.done; i < tile.until; ++i) {
    const int count = tile.pieces[i - tile.done];
    for (int k = 1; k <= count; ++k, ++segment) {
      segment->irradiance0 = layer++;
      segment->irradiance1 = layer;
      if (k < count) {
        timeline.write_between(i, 4 * k / count, *layer);
      } else {
        timeline.write(i + 1, *layer);
      }
    }
  }
  tile.done = timeline.forget_before(tile.until);
}

/// Brings forward the tiles that content of others may come into.
void AdaptiveSampler::watch() {
  const auto arrival = [&](const TileState& from, double gap) {
    return from.timeline.time(from.timeline.size() - 1) +
           static_cast<TimeNs>(std::min((gap + options_.max_motion_px) / from.speed * kNsPerS, 1e18));
  };
  for (const std::uint32_t index : asked_) {
    TileState& own = tiles_[index];
    const int column = static_cast<int>(index) % columns_, row = static_cast<int>(index) / columns_;
    for (int y = std::max(row - kReach, 0); y <= std::min(row + kReach, rows_ - 1); ++y) {
      for (int x = std::max(column - kReach, 0); x <= std::min(column + kReach, columns_ - 1); ++x) {
        TileState& other = tiles_[static_cast<std::size_t>(y * columns_ + x)];
        const double gap = options_.tile_px * std::max(std::max(std::abs(x - column), std::abs(y - row)) - 1, 0);
        const auto bring_forward = [&](TileState& tile, TimeNs t) {
          if (tile.reason != Reason::next || tile.due == kNever || t >= tile.due) return;
          const TimeNs last = tile.timeline.time(tile.timeline.size() - 1);
          tile.due = after(tile, static_cast<double>(std::max<TimeNs>(t - last, 0)));
        };
        if (own.speed > 0) bring_forward(other, arrival(own, gap));
        if (other.speed > 0 && other.timeline.size() > 0) bring_forward(own, arrival(other, gap));
      }
    }
  }
}

/// Is the tile's next sample due so soon after t that it can be taken with others?
bool AdaptiveSampler::nearly_due(const TileState& tile, TimeNs t) const {
  if (tile.due == kNever || tile.timeline.size() == 0) return false;
  const TimeNs last = tile.timeline.time(tile.timeline.size() - 1);
  return t - last >= shortest_ && static_cast<double>(tile.due - t) <= kSlack * static_cast<double>(tile.due - last);
}

/// Asks for the tiles that are due first.
void AdaptiveSampler::request() {
  TimeNs t = kNever, known = context_.span.end;
  for (const TileState& tile : tiles_) {
    t = std::min(t, tile.due);
    known = std::min(known, tile.timeline.size() > 0 ? tile.timeline.time(tile.done) : context_.span.start);
  }
  watermark_ = known;
  asked_.clear();
  request_.t = t;
  request_.tiles.clear();
  if (t == kNever) return;
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    TileState& tile = tiles_[i];
    if (tile.due != t && !(tile.reason == Reason::next && nearly_due(tile, t))) continue;
    asked_.push_back(static_cast<std::uint32_t>(i));
    request_.tiles.push_back(tile.timeline.tile());
    if (tile.reason == Reason::bisection) ++statistics_.bisections;
    if (tile.reason == Reason::audit) ++statistics_.audits;
  }
}

}  // namespace

std::unique_ptr<Sampler> make_adaptive_sampler(const AdaptiveSampling& options, const SamplingContext& context) {
  return std::make_unique<AdaptiveSampler>(options, context);
}

}  // namespace esim

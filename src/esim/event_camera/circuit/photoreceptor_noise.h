#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "esim/core/random.h"
#include "esim/core/time.h"

namespace esim::inline event_camera {

/// The noise of a photoreceptor, as brightness (natural logarithm of the photocurrent).
struct NoiseState {
  double y = 0;  ///< at the photodiode, whose pole has the time constant t1 = Q / I
  double x = 0;  ///< after the source follower, whose pole has the time constant t2: what the comparators see
};

/// A 2 x 2 matrix that acts on (y, x).
struct NoiseMatrix {
  double yy = 0, yx = 0, xy = 0, xx = 0;

  NoiseState operator*(const NoiseState& s) const { return {yy * s.y + yx * s.x, xy * s.y + xx * s.x}; }
};

/// Shot noise of the photocurrent I through the two poles of a pixel (docs/methods/circuit.md):
///
///   y' = -y / t1 + white noise,   x' = (y - x) / t2,   t1 = Q / I,
///   Var y = q / Q in any light,   Var x = (q / Q) t1 / (t1 + t2) = q / (Q + I t2),
///
/// with the elementary charge q and the charge Q that moves the photoreceptor by one e-fold.
///
/// The noise is a function of time that is evaluated only where it is needed. A pixel draws its state at nodes. Near a
/// threshold, and while the signal moves, the intervals between nodes are steps, so short that x is a cubic in them.
/// Elsewhere they are 2 or 4 (t1 + t2) long; the state in the middle of such an interval follows from the states at
/// its ends by the bridge of the process, and so on down to leaves as short as steps. Every draw is addressed by pixel,
/// node and place in this tree. So the noise does not depend on the times at which it is evaluated.
class PhotoreceptorNoise {
 public:
  static constexpr int kLevels = 6;  ///< of intervals between nodes: 4, 2, 1, 1/2, 1/4 times (t1 + t2), and steps
  static constexpr int kSteps = kLevels - 1;

  /// `variance` is q / Q, `t2_ns` the time constant of the second pole, [t1_min_ns, t1_max_ns] those of the first one
  /// in the brightest and in the darkest light. First poles are rounded to steps of 1 %.
  PhotoreceptorNoise(double variance, double t2_ns, double t1_min_ns, double t1_max_ns, const AddressedRandom& random);

  /// The interval between two nodes of a pixel.
  struct Interval {
    NoiseState from, to;
    std::uint32_t pixel = 0, node = 0;  // the number of the node at its start
    std::int32_t pole = 0;              // of t1, by which the length is chosen
    std::int32_t level = 0;
    double length = 0;  // ns
  };

  /// The number of the first pole, for Interval::pole.
  std::int32_t pole_of(double log_t1_ns) const {
    const double place = (log_t1_ns - log_first_) * per_log_step_ + 0.5;
    return static_cast<std::int32_t>(std::clamp(place, 0.0, static_cast<double>(poles_.size()) - 0.5));
  }
  /// Steps keep the length of their `pole` in other light, where ln(t1) is larger by `drift` times kDriftStep, |drift|
  /// up to kDrifts. What they do is interpolated, so that rounding errors of the light have no large consequences.
  static constexpr int kDrifts = 4;
  static constexpr double kDriftStep = 0.05;
  double t1_ns(std::int32_t pole) const { return poles_[static_cast<std::size_t>(pole)].t1; }
  double t2_ns() const { return t2_; }
  /// The length of an interval, ns.
  double length(std::int32_t pole, std::int32_t level) const {
    return poles_[static_cast<std::size_t>(pole)].steps[static_cast<std::size_t>(level)].h;
  }

  /// Standard deviation of x in steady light.
  double deviation(std::int32_t pole) const { return poles_[static_cast<std::size_t>(pole)].deviation; }
  double deviation_at(double t1_ns) const { return std::sqrt(variance_ * t1_ns / (t1_ns + t2_)); }

  /// The level of the next interval, for the distance of the nearer threshold in standard deviations. No limit may be
  /// the distance at which noise begins to matter, where rounding would decide.
  std::int32_t level_for(std::int32_t pole, double z) const {
    const std::int32_t level = z < 2.5 ? 4 : z < 3.5 ? 3 : z < 4.5 ? 2 : z < 5.2 ? 1 : 0;
    return level >= poles_[static_cast<std::size_t>(pole)].first_in_steps ? kSteps : level;
  }

  /// The draws of a pixel's steps, for 8 nodes at a time.
  struct StepDraws {
    std::uint32_t block = ~0U;  ///< nodes 8 block to 8 block + 7
    alignas(64) std::array<float, 16> first, second;
  };

  /// The first interval of a pixel, from the stationary distribution.
  Interval first(std::uint32_t pixel, std::int32_t pole, std::int32_t level, StepDraws& draws) const;

  /// The interval that begins with state `from` at node `node`. `drift` matters for steps only; `draws` are those of
  /// the pixel.
  Interval next(const NoiseState& from, std::uint32_t pixel, std::uint32_t node, std::int32_t pole, std::int32_t level,
                double drift, StepDraws& draws) const;

  /// The state at the end of the step that begins with state `from` at node `node`.
  NoiseState after_step(const NoiseState& from, std::uint32_t pixel, std::uint32_t node, std::int32_t pole,
                        double drift, StepDraws& draws) const {
    if (draws.block != node / kBlock) draw_block(pixel, node / kBlock, draws);
    const double n1 = static_cast<double>(draws.first[node % kBlock]),
                 n2 = static_cast<double>(draws.second[node % kBlock]);
    const double place = drift + kDrifts, below = std::clamp(std::floor(place), 0.0, 2.0 * kDrifts - 1);
    const Step* const steps = &poles_[static_cast<std::size_t>(pole)].drifting[static_cast<std::size_t>(below)];
    const auto between = [&](double a, double b) { return a + (place - below) * (b - a); };
    const NoiseMatrix &d0 = steps[0].drift, &d1 = steps[1].drift, &s0 = steps[0].spread, &s1 = steps[1].spread;
    return {between(d0.yy, d1.yy) * from.y + between(s0.yy, s1.yy) * n1,
            between(d0.xy, d1.xy) * from.y + d0.xx * from.x + between(s0.xy, s1.xy) * n1 + between(s0.xx, s1.xx) * n2};
  }

  /// Bounds of x during a step: a cubic lies between the control points of its Bezier curve.
  std::pair<double, double> step_bounds(const NoiseState& from, const NoiseState& to, double h) const {
    return std::minmax({from.x, to.x, from.x + slope(from) * h / 3, to.x - slope(to) * h / 3});
  }

  /// The state `gap` ns after the state `from`, with the draw of node `node` of the pixel: for times without intervals.
  NoiseState after(const NoiseState& from, double gap, std::uint32_t pixel, std::uint32_t node,
                   std::int32_t pole) const;

  /// The state `tau` ns after the start of an interval, 0 <= tau <= length.
  NoiseState at(const Interval& interval, double tau) const;

  /// A threshold that noise plus signal reach: tau in ns after the start of the interval, polarity 1 or -1.
  struct Crossing {
    double tau = 0;
    int polarity = 0;
  };

  /// Bounds of x until some time after the end of a search.
  struct Quiet {
    double until = 0;  ///< ns after the start of the interval
    double low = 0, high = 0;
  };

  /// The first time in [from, to], ns after the start of the interval, at which x + signal reaches `upper` or `lower`.
  /// The signal has value(tau), slope(tau) in 1/ns, and range(a, b), which contains its values on [a, b]. Without a
  /// crossing, sets `quiet`.
  template <typename Signal>
  std::optional<Crossing> first_crossing(const Interval& interval, const Signal& signal, double lower, double upper,
                                         double from, double to, Quiet& quiet) const;

 private:
  static constexpr std::uint32_t kBlock = 8;  // of StepDraws

  /// A step of this process: state(t + h) = drift state(t) + spread (n1, n2), n1 and n2 standard normal.
  struct Step {
    double h = 0;
    NoiseMatrix drift, spread;
  };
  /// The state in the middle of an interval: from_start S0 + from_end S1 + spread (n1, n2).
  struct Bridge {
    double h = 0;  // of the interval
    NoiseMatrix from_start, from_end, spread;
    double deviation = 0;  // of x in the middle
    bool leaf = false;     // short enough for a cubic
  };
  struct Pole {
    double t1 = 0, deviation = 0;
    std::array<Step, kLevels> steps;             // by level
    std::array<Step, 2 * kDrifts + 1> drifting;  // of steps, by drift
    std::vector<Bridge> bridges;                 // of the long intervals, by level plus depth, then those of steps
    std::size_t step_bridge = 0;                 // the first of steps
    std::int32_t first_in_steps = 0;             // this level and further ones are of at most 8 steps

    std::size_t bridge_of(std::int32_t level) const {
      return level == kSteps ? step_bridge : static_cast<std::size_t>(level);
    }
  };
  struct Piece {
    NoiseState from, to;
    double start = 0;         // ns after the start of the interval
    std::uint32_t index = 1;  // 1: the interval; 2 i and 2 i + 1: the halves of i
    std::size_t bridge = 0;
  };

  Step make_step(double t1, double h) const;
  Bridge make_bridge(double t1, double h) const;
  double step_length(double t1) const;
  void draw_block(std::uint32_t pixel, std::uint32_t block, StepDraws& draws) const;
  NoiseState middle(const Interval& interval, const Piece& piece, const Bridge& bridge) const;
  std::array<double, 2> normals(const Interval& interval, std::uint32_t index) const {
    return random_.normals(interval.pixel, (std::uint64_t{interval.node} << 32) | index);
  }
  double slope(const NoiseState& state) const { return (state.y - state.x) / t2_; }

  /// Bounds of x on a piece, except with a probability below 1e-3 where it matters.
  std::pair<double, double> bounds(const Piece& piece, const Bridge& bridge) const;

  template <typename Signal>
  std::optional<Crossing> search(const Pole& pole, const Interval& interval, const Piece& piece, const Signal& signal,
                                 double lower, double upper, double from, double to, Quiet& quiet) const;

  /// Longer pieces are leaves too while the signal moves so fast that what a cubic neglects hardly moves the crossing.
  static constexpr double kCoarse = 0.3;  // neglected deviation, in changes of the signal over the piece

  double variance_, t2_, log_first_, per_log_step_;
  double coarse_ = 0;  // maximum length of such a piece, ns
  AddressedRandom random_;
  std::vector<Pole> poles_;
};

/// A cubic on [0, h] with these values and slopes at its ends.
struct NoiseCubic {
  double v0, s0, v1, s1, h;

  double value(double t) const {
    const double u = t / h, w = 1 - u;
    return w * w * ((1 + 2 * u) * v0 + u * h * s0) + u * u * ((1 + 2 * w) * v1 - w * h * s1);
  }
  double slope(double t) const {
    const double u = t / h;
    return 6 * u * (1 - u) * (v1 - v0) / h + (1 - u) * (1 - 3 * u) * s0 + u * (3 * u - 2) * s1;
  }

  /// The first t in [0, h] at which it reaches `upper` (1) or `lower` (-1).
  std::optional<std::pair<double, int>> first_exit(double lower, double upper) const;
};

template <typename Signal>
std::optional<PhotoreceptorNoise::Crossing> PhotoreceptorNoise::first_crossing(const Interval& interval,
                                                                               const Signal& signal, double lower,
                                                                               double upper, double from, double to,
                                                                               Quiet& quiet) const {
  quiet = {to, 0, 0};
  const Pole& pole = poles_[static_cast<std::size_t>(interval.pole)];
  const Piece whole{interval.from, interval.to, 0.0, 1, pole.bridge_of(interval.level)};
  return search(pole, interval, whole, signal, lower, upper, from, to, quiet);
}

template <typename Signal>
std::optional<PhotoreceptorNoise::Crossing> PhotoreceptorNoise::search(const Pole& pole, const Interval& interval,
                                                                       const Piece& piece, const Signal& signal,
                                                                       double lower, double upper, double from,
                                                                       double to, Quiet& quiet) const {
  const Bridge& bridge = pole.bridges[piece.bridge];
  const double a = std::max(from, piece.start), b = std::min(to, piece.start + bridge.h);
  if (a >= b) return std::nullopt;
  const double slope_here = std::abs(signal.slope(a));
  if (bridge.leaf || (bridge.h <= coarse_ && bridge.deviation < kCoarse * slope_here * bridge.h)) {
    const NoiseCubic noise{piece.from.x, slope(piece.from), piece.to.x, slope(piece.to), bridge.h};
    const double u = a - piece.start, v = b - piece.start;
    const NoiseCubic sum{noise.value(u) + signal.value(a), noise.slope(u) + signal.slope(a),
                         noise.value(v) + signal.value(b), noise.slope(v) + signal.slope(b), b - a};
    const auto exit = sum.first_exit(lower, upper);
    if (!exit) {
      // A cubic lies between the control points of its Bezier curve.
      const auto [low, high] =
          std::minmax({noise.v0, noise.v1, noise.v0 + noise.s0 * noise.h / 3, noise.v1 - noise.s1 * noise.h / 3});
      if (b >= to) quiet = {piece.start + bridge.h, low, high};
      return std::nullopt;
    }
    return Crossing{a + exit->first, exit->second};
  }
  const auto [low, high] = bounds(piece, bridge);
  const auto [signal_low, signal_high] = signal.range(a, b);
  if (low + signal_low > lower && high + signal_high < upper) {
    if (b >= to) quiet = {piece.start + bridge.h, low, high};
    return std::nullopt;
  }
  const NoiseState centre = middle(interval, piece, bridge);
  const Piece first{piece.from, centre, piece.start, 2 * piece.index, piece.bridge + 1};
  if (const auto crossing = search(pole, interval, first, signal, lower, upper, from, to, quiet)) return crossing;
  const Piece second{centre, piece.to, piece.start + 0.5 * bridge.h, 2 * piece.index + 1, piece.bridge + 1};
  return search(pole, interval, second, signal, lower, upper, from, to, quiet);
}

}  // namespace esim::inline event_camera

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
  /// A cubic lies between the control points of its Bezier curve.
  std::pair<double, double> bounds() const { return std::minmax({v0, v1, v0 + s0 * h / 3, v1 - s1 * h / 3}); }

  /// The first t in [0, h] at which it reaches `upper` (1) or `lower` (-1).
  std::optional<std::pair<double, int>> first_exit(double lower, double upper) const;
};

/// Shot noise of the photocurrent I through the two poles of a pixel (docs/methods/circuit.md):
///
///   y' = -y / t1 + white noise,   x' = (y - x) / t2,   t1 = Q / I,
///   Var y = q / Q in any light,   Var x = (q / Q) t1 / (t1 + t2) = q / (Q + I t2),
///
/// with the elementary charge q and the charge Q that moves the photoreceptor by one e-fold.
///
/// A pixel draws its noise at nodes, whose distances are steps so short that x is a cubic in them. Each node has a
/// number; every draw is addressed by pixel and node. So the noise does not depend on the times at which it is looked
/// at. Where noise does not matter, a pixel has no nodes, and goes on by the exact transition over the gap.
class PhotoreceptorNoise {
 public:
  /// `variance` is q / Q, `t2_ns` the time constant of the second pole, [t1_min_ns, t1_max_ns] those of the first one
  /// in the brightest and in the darkest light. First poles are rounded to steps of 1 %.
  PhotoreceptorNoise(double variance, double t2_ns, double t1_min_ns, double t1_max_ns, const AddressedRandom& random);

  /// The number of the first pole: it chooses the length of steps.
  std::int32_t pole_of(double log_t1_ns) const {
    const double place = (log_t1_ns - log_first_) * per_log_step_ + 0.5;
    return static_cast<std::int32_t>(std::clamp(place, 0.0, static_cast<double>(poles_.size()) - 0.5));
  }
  /// Steps keep the length of their pole in other light, where ln(t1) is larger by `drift` times kDriftStep. What they
  /// do is interpolated for |drift| up to kDrifts, so that rounding errors of the light have no large consequences.
  static constexpr int kDrifts = 4;
  static constexpr double kDriftStep = 0.05;

  double t1_ns(std::int32_t pole) const { return poles_[static_cast<std::size_t>(pole)].t1; }
  double t2_ns() const { return t2_; }
  double step_ns(std::int32_t pole) const { return poles_[static_cast<std::size_t>(pole)].step; }

  double variance() const { return variance_; }  ///< of y
  /// Standard deviation of x in steady light.
  double deviation(std::int32_t pole) const { return poles_[static_cast<std::size_t>(pole)].deviation; }
  double deviation_at(double t1_ns) const { return std::sqrt(variance_ * t1_ns / (t1_ns + t2_)); }

  /// A step: y1 = yy y0 + n_yy n1, x1 = xy y0 + xx x0 + n_xy n1 + n_xx n2, with the standard normal deviates n1 and n2
  /// of its end. xx = exp(-step / t2).
  struct Step {
    double yy = 0, xy = 0, n_yy = 0, n_xy = 0, n_xx = 0;
  };
  /// Those of a pole for drifts of -kDrifts to kDrifts, and xx.
  const Step* steps(std::int32_t pole) const { return &steps_[(2 * kDrifts + 1) * static_cast<std::size_t>(pole)]; }
  double decay(std::int32_t pole) const { return poles_[static_cast<std::size_t>(pole)].decay; }

  /// The draws of the nodes first to first + 3 of `count` pixels, a power of two up to kDrawn; `first` is even.
  /// n[k][j][i] is n_(j+1) of node first[i] + k of pixel pixels[i].
  static constexpr std::size_t kDrawn = 8, kNodesDrawn = 4;
  using Draws = std::array<std::array<std::array<float, kDrawn>, 2>, kNodesDrawn>;
  void draw(std::size_t count, const std::uint32_t* pixels, const std::uint32_t* first, Draws& n) const;

  /// The state at the first node of a pixel, from the stationary distribution.
  NoiseState first(std::uint32_t pixel, std::int32_t pole) const;

  /// The state a step after the state `from`, with the draws of its node.
  NoiseState after_step(const NoiseState& from, const std::array<float, 2>& n, std::int32_t pole, double drift) const;

  /// The state `gap` ns after the state `from`, at node `node`: for times without steps.
  NoiseState after_gap(const NoiseState& from, double gap, std::uint32_t pixel, std::uint32_t node,
                       std::int32_t pole) const;

  /// A part of a step that begins at a node: part 1 is the whole step, 2 i and 2 i + 1 are the halves of i.
  struct Part {
    NoiseState from, to;
    double start = 0;  ///< ns after the node
    std::uint32_t index = 1;
    std::size_t depth = 0;
  };
  double length(std::int32_t pole, const Part& part) const {
    return std::ldexp(step_ns(pole), -static_cast<int>(part.depth));
  }
  /// Whether x is cubic() in this part.
  bool is_cubic(std::int32_t pole, const Part& part) const {
    return part.depth == poles_[static_cast<std::size_t>(pole)].bridges;
  }
  NoiseCubic cubic(std::int32_t pole, const Part& part) const {
    const NoiseState &from = part.from, &to = part.to;
    return {from.x, (from.y - from.x) / t2_, to.x, (to.y - to.x) / t2_, length(pole, part)};
  }
  /// The draws within a step, which are made together when they are needed.
  struct Middles {
    Middles(std::uint32_t pixel_, std::uint32_t node_) : pixel(pixel_), node(node_) {}

    std::uint32_t pixel, node;
    bool drawn = false;
    alignas(64) std::array<float, 16> n1, n2;  ///< by index of the part
  };
  std::pair<Part, Part> halves(std::int32_t pole, const Part& part, Middles& middles) const;

  /// Bounds of x in a part, except with a probability below 1e-4 where it matters. The values at both ends, and those
  /// which the slopes lead to after reach(), are within them by margin().
  std::pair<double, double> bounds(std::int32_t pole, const Part& part) const {
    const double along = reach(pole, part.depth) / t2_;
    const auto [low, high] = std::minmax({part.from.x, part.to.x, part.from.x + (part.from.y - part.from.x) * along,
                                          part.to.x - (part.to.y - part.to.x) * along});
    return {low - margin(pole, part.depth), high + margin(pole, part.depth)};
  }
  double reach(std::int32_t pole, std::size_t depth) const {
    return std::min(std::ldexp(step_ns(pole), -static_cast<int>(depth)) / 3, t2_);
  }
  double margin(std::int32_t pole, std::size_t depth) const {
    const Pole& of = poles_[static_cast<std::size_t>(pole)];
    return depth == of.bridges ? 0.0 : kBoundDeviations * bridges_[of.first_bridge + depth].deviation;
  }

  /// x at `tau` ns after a node, within its step.
  double at(std::int32_t pole, Part part, double tau, Middles& middles) const;

 private:
  static constexpr double kBoundDeviations = 4.5;
  static constexpr std::size_t kMaxDepth = 3;  // of parts

  /// The state in the middle of a part: each row is that of y or x, from y and x at the start and at the end, n1 and
  /// n2.
  struct Bridge {
    std::array<double, 6> y, x;
    double deviation = 0;  // of x in the middle
  };
  struct Pole {
    double t1 = 0, deviation = 0, step = 0, decay = 0;
    std::size_t first_bridge = 0, bridges = 0;  // by depth
  };

  Bridge make_bridge(double t1, double h) const;
  void draw(Middles& middles) const;

  double variance_, t2_, log_first_, per_log_step_;
  AddressedRandom random_;
  std::vector<Pole> poles_;
  std::vector<Step> steps_;
  std::vector<Bridge> bridges_;
};

}  // namespace esim::inline event_camera

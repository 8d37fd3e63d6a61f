#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "esim/core/random.h"
#include "esim/core/time.h"

namespace esim::inline event_camera {

/// The noise of a photoreceptor, as brightness (natural logarithm of the photocurrent).
struct NoiseState {
  float y = 0;  ///< at the photodiode, whose pole has the time constant t1 = Q / I
  float x = 0;  ///< after the source follower, whose pole has the time constant t2: what the comparators see
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
  /// in the brightest and in the darkest light. First poles are rounded to steps of 1 %; the steps of each are found
  /// when it is first used.
  PhotoreceptorNoise(double variance, double t2_ns, double t1_min_ns, double t1_max_ns, const AddressedRandom& random);

  /// The number of the first pole: it chooses the length of steps.
  std::int32_t pole_of(double log_t1_ns) const {
    const double place = (log_t1_ns - log_first_) * per_log_step_ + 0.5;
    return static_cast<std::int32_t>(std::clamp(place, 0.0, last_place_ + 0.5));
  }
  double t1_ns(std::int32_t pole) const { return any(pole).t1; }
  double t2_ns() const { return t2_; }
  double step_ns(std::int32_t pole) const { return used(pole).step_ns; }

  double variance() const { return variance_; }  ///< of y
  /// Standard deviation of x in steady light.
  double deviation(std::int32_t pole) const { return any(pole).deviation; }
  /// The same for any t1: linear in ln(t1) between the poles; and its slope.
  struct Deviation {
    double value = 0, slope = 0;
  };
  Deviation deviation_at(double log_t1_ns) const {
    const double place = std::clamp((log_t1_ns - log_first_) * per_log_step_, 0.0, last_place_);
    const auto below = static_cast<std::size_t>(place);
    const double value = deviations_[below], step = deviations_[below + 1] - value;
    return {value + (place - static_cast<double>(below)) * step, step * per_log_step_};
  }

  /// A step: y1 = yy y0 + n_yy n1, x1 = xy y0 + xx x0 + n_xy n1 + n_xx n2, with the standard normal deviates n1 and n2
  /// of its end. xx = exp(-step / t2). Steps keep the length of their pole in other light, where ln(t1) is larger by
  /// `drift`, up to kMaxDrift either way: the other factors are parabolas c0 + c1 drift + c2 drift^2.
  struct Step {
    enum Factor : std::uint8_t { yy, xy, n_yy, n_xy, n_xx };
    static constexpr std::size_t kFactors = 5;
    std::array<std::array<float, 3>, kFactors> parabolas{};
    float xx = 0;
  };
  static constexpr double kMaxDrift = 0.2;
  const Step& step(std::int32_t pole) const { return used(pole).step; }

  /// The draws of the nodes first and first + 1 of `count` pixels, up to kDrawn; `first` is even.
  /// n[k][j][i] is n_(j+1) of node first[i] + k of pixel pixels[i].
  static constexpr std::size_t kDrawn = 8, kNodesDrawn = 2;
  using Draws = std::array<std::array<std::array<float, kDrawn>, 2>, kNodesDrawn>;
  void draw(std::size_t count, const std::uint32_t* pixels, const std::uint32_t* first, Draws& n) const;

  /// The state at the first node of a pixel, from the stationary distribution.
  NoiseState first(std::uint32_t pixel, std::int32_t pole) const;

  /// The state a step after the state `from`, with the draws of its node.
  NoiseState after_step(const NoiseState& from, const std::array<float, 2>& n, std::int32_t pole, float drift) const;

  /// The state at a node `gap` ns after the state `from`, with the draws of the node: for times without steps.
  NoiseState after_gap(const NoiseState& from, const std::array<float, 2>& n, double gap, std::int32_t pole) const;

  /// Within a step, x is a cubic in each of kParts equal parts. The states at their ends:
  static constexpr std::size_t kParts = 8;
  struct Path {
    std::array<float, kParts + 1> y, x;
  };
  /// The path from the state `from` at a node to the state `to` a step later, drawn by the bridge of the process.
  Path path(const NoiseState& from, const NoiseState& to, std::uint32_t pixel, std::uint32_t node,
            std::int32_t pole) const;
  double part_ns(std::int32_t pole) const { return step_ns(pole) / kParts; }
  NoiseCubic cubic(const Path& path, std::size_t part, std::int32_t pole) const {
    const auto x0 = static_cast<double>(path.x[part]), x1 = static_cast<double>(path.x[part + 1]);
    const auto y0 = static_cast<double>(path.y[part]), y1 = static_cast<double>(path.y[part + 1]);
    return {x0, (y0 - x0) / t2_, x1, (y1 - x1) / t2_, part_ns(pole)};
  }
  /// x at `tau` ns after the node.
  double at(const Path& path, double tau, std::int32_t pole) const {
    const double length = part_ns(pole), place = std::clamp(std::floor(tau / length), 0.0, kParts - 1.0);
    return cubic(path, static_cast<std::size_t>(place), pole).value(tau - place * length);
  }

  /// Bounds of x in a step, except with a probability below 1e-4 where it matters: the values at both ends, and those
  /// to which the slopes lead after along() t2, are within them by margin().
  std::pair<double, double> bounds(const NoiseState& from, const NoiseState& to, std::int32_t pole) const {
    const float reach = along(pole);
    const auto [low, high] =
        std::minmax({from.x, to.x, from.x + (from.y - from.x) * reach, to.x - (to.y - to.x) * reach});
    return {static_cast<double>(low - margin(pole)), static_cast<double>(high + margin(pole))};
  }
  float along(std::int32_t pole) const { return used(pole).along; }
  float margin(std::int32_t pole) const { return used(pole).margin; }

 private:
  static constexpr float kBoundDeviations = 4.5F;
  static constexpr std::size_t kHalvings = 3;
  static_assert(kParts == 1U << kHalvings);

  /// The state in the middle of an interval: each row is that of y or x, from y and x at the start and at the end, n1
  /// and n2.
  struct Bridge {
    std::array<float, 6> y, x;
    float deviation = 0;  // of x in the middle
  };
  struct Pole {
    double t1 = 0, deviation = 0;
    // Found when it is first used:
    std::atomic<bool> found = false;
    double step_ns = 0;
    float along = 0, margin = 0;
    std::array<Bridge, kHalvings> bridges{};  // of the step, of its halves, ...
    Step step{};
  };
  struct Poles {
    std::vector<Pole> all;
    std::mutex finding;
  };

  const Pole& any(std::int32_t pole) const { return poles_->all[static_cast<std::size_t>(pole)]; }
  const Pole& used(std::int32_t pole) const {
    Pole& used = poles_->all[static_cast<std::size_t>(pole)];
    if (!used.found.load(std::memory_order_acquire)) find_steps(used);
    return used;
  }
  void find_steps(Pole& pole) const;
  Bridge make_bridge(double t1, double h) const;
  Step make_step(const Pole& pole) const;

  double variance_, t2_, log_first_, per_log_step_, last_place_ = 0;
  AddressedRandom random_;
  std::shared_ptr<Poles> poles_;
  std::vector<double> deviations_;  // of the poles, and of one more
};

}  // namespace esim::inline event_camera

// Accelerates (5) and (6), reference_signal.h, by Halley's method instead of bisection.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

namespace esim::inline event_camera {

/// No crossing within a segment.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// The first time at which a signal leaves the open interval between two levels.
struct Crossing {
  double tau = kNever;  ///< ns after the segment's start
  bool on = false;      ///< through the upper level
};

/// The signal of a comparator on a segment after a low-pass with one pole, or with two equal poles, plus the drift. tau
/// is in ns after the segment's start; the search starts at from(). With u = rate tau, m = 1 - exp(-u) and the input
/// L(u) = start + rise u, the poles respond with
///     F1 = F1(0) + (start - F1(0)) m + rise (u - m)
///     F2 = F2(0) + (start - F2(0)) m + (F1(0) - start) u (1 - m) + rise (2 u - 2 m - u m),
/// which lose no precision for small u.
class RelaxingSignal {
 public:
  /// One pole with output `filtered` when its input, `start`, begins to rise with `slope` per ns. `moved` is m at the
  /// segment's end.
  static RelaxingSignal first_order(double rate, double moved, double filtered, double start, double slope) {
    RelaxingSignal signal(false, rate, moved, filtered, filtered, start, slope / rate);
    const double distance = start - filtered;
    signal.at_from_ = {0, filtered, distance, signal.rise_ - distance};
    return signal;
  }

  /// Two poles in series, with outputs `filtered1` and `filtered2`.
  static RelaxingSignal second_order(double rate, double moved, double filtered1, double filtered2, double start,
                                     double slope) {
    RelaxingSignal signal(true, rate, moved, filtered1, filtered2, start, slope / rate);
    signal.at_from_ = {0, filtered2, filtered1 - filtered2, start - 2 * filtered1 + filtered2};
    return signal;
  }

  double from() const { return at_from_.u / rate_; }
  double value(double tau) const;
  double value() const { return at_from_.value; }  ///< at from()
  double slope() const { return at_from_.slope; }  ///< at from(), per u
  void advance(double tau) { at_from_ = at(rate_ * tau); }

  /// Adds offset + drift * tau.
  void add(double offset, double drift);

  /// First time in [from, end] at which the signal is at `high` or above, or at `low` or below.
  Crossing first_crossing(double end, double low, double high) const;

 private:
  /// The signal at one time, with its derivatives.
  struct Point {
    double u = 0, value = 0, slope = 0, bend = 0;
  };
  RelaxingSignal(bool two_poles, double rate, double moved, double filtered1, double filtered2, double start,
                 double rise)
      : two_poles_(two_poles),
        rate_(rate),
        start_(start),
        rise_(rise),
        filtered1_(filtered1),
        filtered2_(filtered2),
        moved_(moved) {}
  Point at(double u) const;
  Point at(double u, double moved) const;
  double solve(double level, const Point& a, const Point& b) const;
  double turn_between(const Point& a, const Point& b) const;
  std::size_t turns(const Point& a, const Point& b, std::array<Point, 3>& points) const;

  bool two_poles_ = false;
  double rate_ = 0;                       // 1/ns
  double start_ = 0, rise_ = 0;           // of the input; rise per u
  double filtered1_ = 0, filtered2_ = 0;  // at the segment's start
  double offset_ = 0, drift_ = 0;         // drift per u
  double moved_ = 0;                      // m at the segment's end
  Point at_from_;
};

}  // namespace esim::inline event_camera

#include "esim/event_camera/pixel/relaxing_signal.h"

#include <algorithm>
#include <cmath>

namespace esim::inline event_camera {
namespace {

/// 1 - exp(-u) for u >= 0, to a dozen digits: several times as fast as std::expm1.
double scalar_moved_after(double u) {
  constexpr double kSmall = 0.01;
  if (u > kSmall) return 1 - std::exp(-u);
  return u * (1 - u / 2 * (1 - u / 3 * (1 - u / 4 * (1 - u / 5 * (1 - u / 6)))));
}

}  // namespace

RelaxingSignal::Point RelaxingSignal::at(double u, double moved) const {
  const double first = filtered1_ + (start_ - filtered1_) * moved + rise_ * (u - moved);
  const double input = start_ + rise_ * u;
  if (!two_poles_) {
    const double slope = input - first;
    return {u, first + offset_ + drift_ * u, slope + drift_, rise_ - slope};
  }
  const double second = filtered2_ + (start_ - filtered2_) * moved + (filtered1_ - start_) * u * (1 - moved) +
                        rise_ * (2 * (u - moved) - u * moved);
  return {u, second + offset_ + drift_ * u, first - second + drift_, input - 2 * first + second};
}

RelaxingSignal::Point RelaxingSignal::at(double u) const { return at(u, scalar_moved_after(u)); }

double RelaxingSignal::value(double tau) const { return at(rate_ * tau).value; }

void RelaxingSignal::add(double offset, double drift) {
  offset_ += offset;
  drift_ += drift / rate_;
  at_from_.value += offset + drift / rate_ * at_from_.u;
  at_from_.slope += drift / rate_;
}

/// Time at which the signal crosses `level` between a and b. It must be monotone there and cross the level. Halley's
/// method, started from the inverse cubic through the ends, with bisection if it leaves the bracket.
double RelaxingSignal::solve(double level, const Point& a, const Point& b) const {
  constexpr double kToleranceNs = 0.05;
  double low = a.u, high = b.u;
  const double rise = b.value - a.value, s = (level - a.value) / rise;
  if (!(s > 0)) return low;
  if (s >= 1) return high;

  const double t = 1 - s;
  double u = t * t * (1 + 2 * s) * a.u + s * s * (3 - 2 * s) * b.u + s * t * rise * (t / a.slope - s / b.slope);
  if (!(u > low && u < high)) u = low + s * (high - low);
  const double tolerance = rate_ * kToleranceNs;
  for (int i = 0; i < 100; ++i) {
    const Point point = at(u);
    const double miss = point.value - level;
    if ((miss < 0) == (rise > 0)) {
      low = u;
    } else {
      high = u;
    }
    const double newton = miss / point.slope, bend = point.bend / point.slope;
    double next = u - newton / (1 - 0.5 * newton * bend);
    const bool inside = next >= low && next <= high;
    if (!inside) next = 0.5 * (low + high);
    const double step = std::fabs(next - u);
    u = next;
    // The next step of Halley's method would be about the cube of this one, times a factor that depends on the
    // curvature.
    if (step <= tolerance || (inside && step * step * step * (1 + bend * bend) <= tolerance)) break;
  }
  return u;
}

/// Time at which the slope changes its sign between a and b, where it is monotone.
double RelaxingSignal::turn_between(const Point& a, const Point& b) const {
  if (!two_poles_) {
    const double distance = start_ - filtered1_;
    return -std::log1p(-(distance + drift_) / (distance - rise_));
  }
  constexpr double kPrecision = 1e-9;
  double low = a.u, high = b.u;
  while (high - low > kPrecision * (1 + high)) {
    const double middle = 0.5 * (low + high);
    ((at(middle).slope < 0) == (a.slope < 0) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The extrema of the signal between a and b, at most two, in order, followed by b.
std::size_t RelaxingSignal::turns(const Point& a, const Point& b, std::array<Point, 3>& points) const {
  std::size_t count = 0;
  const auto add_turn = [&](const Point& from, const Point& to) {
    if ((from.slope < 0) == (to.slope < 0) || from.slope == 0 || to.slope == 0) return;
    points[count++] = at(std::clamp(turn_between(from, to), from.u, to.u));
  };
  // After two poles the slope is monotone on both sides of its extremum.
  const double resonance = filtered1_ - start_ + rise_;
  const double steepest = two_poles_ && resonance != 0 ? 2.0 - (filtered2_ - start_ + 2 * rise_) / resonance : a.u;
  if (steepest > a.u && steepest < b.u) {
    const Point middle = at(steepest);
    add_turn(a, middle);
    add_turn(middle, b);
  } else {
    add_turn(a, b);
  }
  points[count++] = b;
  return count;
}

Crossing RelaxingSignal::first_crossing(double end, double low, double high) const {
  Point a = at_from_;
  if (a.value >= high) return {from(), true};
  if (a.value <= low) return {from(), false};
  std::array<Point, 3> points;
  const std::size_t count = turns(a, at(rate_ * end, moved_), points);
  for (std::size_t i = 0; i < count; ++i) {
    const Point& b = points[i];
    if (b.value >= high) return {solve(high, a, b) / rate_, true};
    if (b.value <= low) return {solve(low, a, b) / rate_, false};
    a = b;
  }
  return {};
}

}  // namespace esim::inline event_camera

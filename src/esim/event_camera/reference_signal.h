#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline event_camera {

/// The signal of a pixel in ReferenceEventCamera: equations (3), (5) and (6) of docs/methods/pixel.md.
///
/// What the comparator of a pixel sees between two frames. tau is in s after the first of them.
struct ReferenceSignal {
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  TimeNs t0, t1;
  double duration;                      // s
  double light0, light1, start, slope;  // E at both frames; L at the first, and its change per s
  int poles;                            // of the photoreceptor's low-pass
  double rate, filtered1, filtered2;    // of each pole: 1 / its time constant, and its output at t0

  double light(double tau) const { return light0 + (light1 - light0) * tau / duration; }

  /// (3) L is linear in time. (5) F after one or two poles, with u = rate tau and m = 1 - exp(-u).
  double after(int pole, double tau) const {
    if (pole == 0) return start + slope * tau;
    const double u = rate * tau, m = -std::expm1(-u), b = slope / rate;
    if (pole == 1) return filtered1 + (start - filtered1) * m + b * (u - m);
    return filtered2 + (start - filtered2) * m + (filtered1 - start) * u * (1 - m) + b * (2 * u - 2 * m - u * m);
  }
  double value(double tau) const { return after(poles, tau); }

  /// (5) dF/dt: each pole follows its input.
  double slope_at(double tau) const { return poles == 0 ? slope : rate * (after(poles - 1, tau) - after(poles, tau)); }

  /// The times between which F + leak tau is monotone: after `from`, until the end. Its slope is monotone as well,
  /// before and after the inflection of F, which exists after two poles.
  std::vector<double> turning_points(double from, double leak) const {
    std::vector<double> ends = {from, duration}, turns;
    if (poles == 2) {
      const double b = slope / rate, u = 2 - (filtered2 - start + 2 * b) / (filtered1 - start + b);
      if (u > rate * from && u < rate * duration) ends.insert(ends.begin() + 1, u / rate);
    }
    for (std::size_t k = 1; k < ends.size(); ++k) {
      const bool rises = slope_at(ends[k - 1]) + leak > 0;
      if (rises == (slope_at(ends[k]) + leak > 0)) continue;
      const auto turned = [&](double tau) { return (slope_at(tau) + leak > 0) != rises; };
      turns.push_back(first_time(ends[k - 1], ends[k], turned));
    }
    turns.push_back(duration);
    return turns;
  }

  /// The time between a and b from which on a condition holds, which holds at b.
  template <class Condition>
  static double first_time(double a, double b, const Condition& holds) {
    for (int bisections = 0; bisections < 100 && a < b; ++bisections) (holds(0.5 * (a + b)) ? b : a) = 0.5 * (a + b);
    return b;
  }

  /// (6) The first time at which F + leak tau reaches `upper` (polarity 1) or `lower` (-1); kNever if it does not.
  double first_crossing(double from, double leak, double lower, double upper, int& polarity) const {
    double begin = from;
    for (const double end : turning_points(from, leak)) {
      const double last = value(end) + leak * end;
      if (last >= upper) {
        polarity = 1;
        return first_time(begin, end, [&](double tau) { return value(tau) + leak * tau >= upper; });
      }
      if (last <= lower) {
        polarity = -1;
        return first_time(begin, end, [&](double tau) { return value(tau) + leak * tau <= lower; });
      }
      begin = end;
    }
    return kNever;
  }
};

}  // namespace esim::inline event_camera

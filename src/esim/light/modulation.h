#pragma once

#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/light/options.h"

namespace esim::inline light {

/// How closely straight lines between the nodes of a modulation m must follow the brightness L = ln(E m + dark) of
/// pixels of irradiance E.
struct LightAccuracy {
  double tolerance = 1e-4;  ///< maximum error of L
  double dark = 1e-3;       ///< added to the irradiance
};

/// The factor m(t) >= 0 by which a flickering light differs from its mean, with mean 1 over a period. It is defined at
/// whole nanoseconds; edges last 1 ns. docs/methods/light.md derives the nodes.
class Modulation {
 public:
  /// `start`: a time on the trajectory's clock that is close to those at which the modulation is evaluated. Throws
  /// UserError if an option is out of range; the message begins with `key`.
  Modulation(const FlickerOptions& options, TimeNs start, const LightAccuracy& accuracy,
             const std::string& key = "flicker");

  /// m(t).
  double at(TimeNs t) const;

  struct Integrals {
    double m, tm;  ///< of m(t) dt, and of (t - t0) m(t) dt; s, s^2
  };
  /// The integrals from t0 to t1, exactly.
  Integrals integrals(TimeNs t0, TimeNs t1) const;

  /// The first node after t; the largest time after the last one. Between two nodes, L is linear in time to within the
  /// tolerance. The nodes depend neither on samples nor on cameras with the same accuracy.
  TimeNs next_node(TimeNs t) const;

 private:
  double periods(TimeNs t) const;
  TimeNs time_of(double periods) const;
  double shape(double phase) const;
  double curvature(double phase, double dark) const;
  void place_nodes(const LightAccuracy& accuracy);
  TimeNs edge(double periods, bool on) const;

  FlickerOptions options_;
  TimeNs start_;
  double phase_;               // at start_
  double scale_;               // of the mean
  std::vector<double> nodes_;  // in order, in [0, 1): smooth shapes; pwm: the edges
};

}  // namespace esim::inline light

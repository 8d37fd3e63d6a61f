#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "esim/fit/circuit/circuit_model.h"
#include "esim/fit/circuit/count_moments.h"

// Private to fit.
namespace esim::inline fit {

/// What the numbers of events of a circuit must agree with. Parameters are logarithms.
struct CircuitTarget {
  CountMoments recorded;
  std::vector<Eigen::VectorXd> without_areas;  ///< means_without_areas(): for the errors of the recorded means
  Eigen::VectorXd start, precision;            ///< before the fit: parameters, and their inverse variances
  Eigen::VectorXd known_precision;             ///< the part of `precision` that was measured
  bool grid = false;                           ///< whether to search from several values of both time constants
};

/// Parameters that agree with the recordings best, at least among those nearby.
struct CircuitSolution {
  Eigen::VectorXd at;
  Eigen::MatrixXd covariance;  ///< of `at`, if the model describes the recordings
  double squares = 0;          ///< of the differences from the recordings, each over its error
  bool found = false;          ///< whether the search ended there
  double degrees = 0;          ///< expected value of `squares`; 0: there are as many parameters as numbers

  double excess() const { return degrees > 0 ? squares / degrees : 1.0; }
};

/// Finds the parameters of a model (docs/methods/fitting.md, section 5, has the steps).
class CircuitSolver {
 public:
  CircuitSolver(const CircuitModel& model, CircuitTarget target, std::uint64_t seed,
                std::function<void(double)> progress);

  /// The best solution first; then others that the recordings do not exclude.
  std::vector<CircuitSolution> solve();

 private:
  struct Candidate {
    Eigen::VectorXd at;
    Eigen::MatrixXd spread;  // covariance of the parameters around `at`
    double squares = 0;
  };
  struct Slopes;
  struct Tangent;

  std::vector<Eigen::VectorXd> starts() const;
  Candidate approach(Eigen::VectorXd at);
  CircuitSolution refine(const Candidate& from);
  void set_tangent(Tangent& t, const Slopes& a, const Slopes& b, const Eigen::MatrixXd& simulated) const;
  Eigen::VectorXd step_from(const Tangent& t, const Eigen::VectorXd& at, const Eigen::VectorXd& simulated) const;
  Eigen::MatrixXd recorded_covariance() const;

  CountMoments simulate(const Eigen::VectorXd& at, const CircuitModel::Effort& effort);
  Slopes find_slopes(const Eigen::VectorXd& at, const Eigen::MatrixXd& spread);
  Eigen::MatrixXd approximate_slopes(const Eigen::VectorXd& at) const;
  Eigen::VectorXd model_variance() const;
  Eigen::MatrixXd limited(const Eigen::MatrixXd& precision) const;
  void work(double pixels);
  std::uint64_t next_seed();

  const CircuitModel& model_;
  CircuitTarget target_;
  std::uint64_t seed_;
  std::function<void(double)> progress_;
  double done_ = 0, all_ = 0;  // simulated pixels
};

}  // namespace esim::inline fit

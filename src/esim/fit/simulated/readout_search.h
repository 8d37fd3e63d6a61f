#pragma once

#include <string>
#include <utility>
#include <vector>

#include "esim/event_camera/options.h"
#include "esim/fit/estimate.h"
#include "esim/fit/simulated/simulation_fit.h"
#include "esim/stats/sensor/sensor_statistics.h"

// Private to fit.
namespace esim::inline fit {

/// Finds the readout of a sensor from the statistics that it shapes: how often rows and columns share time stamps, and
/// events per time stamp (docs/methods/fitting.md, section 4).
class ReadoutSearch {
 public:
  ReadoutSearch(const SensorStatistics& real, SimulatedStatistics simulate)
      : real_(real), simulate_(std::move(simulate)) {}

  /// Changes the readout of a sensor, whose numbers of events must be those of the recording.
  void run(EventCameraOptions& sensor);

  std::vector<Estimate> take_estimates() { return std::move(estimates_); }

 private:
  /// The times of an arbiter that visits the rows in turn, us.
  struct Rows {
    double round = 0;  ///< row_scan of all rows
    double time = 0, rest = 0;
  };
  /// What is tried for one of them, and the sums of deviations that were found.
  struct Axis {
    double Rows::*time;
    std::vector<double> values;
    std::vector<std::pair<double, double>> tried{};  // value, sum
  };

  double sum_of_deviations(const EventCameraOptions& sensor) const;
  double sum_of_deviations(EventCameraOptions sensor, const Rows& rows) const;
  void put(EventCameraOptions& sensor, const Rows& rows) const;
  void search_rows(const EventCameraOptions& sensor);
  void try_values(const EventCameraOptions& sensor, Axis& axis, const std::vector<double>& values);
  void report(const char* name, Axis axis, double scale);
  void unknown(const char* name, std::string why);

  const SensorStatistics& real_;
  SimulatedStatistics simulate_;
  Rows rows_;        // the best ones
  double best_ = 0;  // their sum of deviations
  std::vector<Estimate> estimates_;
};

}  // namespace esim::inline fit

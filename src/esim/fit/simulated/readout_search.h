#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "esim/event_camera/options.h"
#include "esim/fit/estimate.h"
#include "esim/stats/sensor/sensor_statistics.h"

// Private to fit.
namespace esim::inline fit {

/// Finds the readout of a sensor from the statistics that it shapes: how often rows and columns share time stamps, and
/// events per time stamp (docs/methods/fitting.md, section 4).
class ReadoutSearch {
 public:
  using Simulate = std::function<SensorStatistics(const EventCameraOptions&)>;

  ReadoutSearch(const SensorStatistics& real, Simulate simulate) : real_(real), simulate_(std::move(simulate)) {}

  /// Changes the readout of a sensor, whose numbers of events must be those of the recording.
  void run(EventCameraOptions& sensor);

  std::vector<Estimate> take_estimates() { return std::move(estimates_); }

 private:
  /// An option of the readout, what is tried for it, and the sums of deviations that were found.
  struct Axis {
    double ReadoutOptions::*option;
    std::vector<double> values;
    std::vector<std::pair<double, double>> tried{};  // value, sum
  };

  double sum_of_deviations(const EventCameraOptions& sensor) const;
  double sum_of_deviations(EventCameraOptions sensor, const ReadoutOptions& readout) const;
  void search_rows(const EventCameraOptions& sensor);
  void try_values(const EventCameraOptions& sensor, Axis& axis, const std::vector<double>& values);
  void report(const char* name, const char* unit, Axis axis);
  void unknown(const char* name, const char* unit, std::string why);

  const SensorStatistics& real_;
  Simulate simulate_;
  ReadoutOptions rows_;  // the best one
  double best_ = 0;      // its sum of deviations
  std::vector<Estimate> estimates_;
};

}  // namespace esim::inline fit

#pragma once

#include <optional>
#include <string>

#include "esim/compare/likeness.h"
#include "esim/compare/same_scene.h"

namespace esim::inline compare {

/// What is known about two recordings.
struct RecordingComparison {
  std::string first_name, second_name;
  double compared_s = 0;  ///< duration of both that was compared
  SensorStatistics first, second;
  std::vector<ComparedStatistic> statistics;
  std::optional<SceneComparison> scene;
};

/// A table of the statistics with their intervals, the verdict, and the matched events.
std::string describe(const RecordingComparison& comparison);

/// The same as JSON in SI units; null for what is not defined.
std::string to_json(const RecordingComparison& comparison);

}  // namespace esim::inline compare

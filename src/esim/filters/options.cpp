#include "esim/filters/options.h"

#include <fmt/format.h>

#include "esim/core/error.h"

namespace esim::inline filters {
namespace {

using Problem = std::optional<FilterProblem>;

Problem problem_of(const AntiFlickerOptions& flicker) {
  if (flicker.low_hz >= flicker.high_hz) {
    return {{"anti_flicker.low_hz",
             fmt::format("must be below high_hz, {} Hz; it is {} Hz", flicker.high_hz, flicker.low_hz)}};
  }
  if (flicker.stop_threshold >= flicker.start_threshold) {
    return {{"anti_flicker.stop_threshold", fmt::format("must be below start_threshold, {}; it is {}",
                                                        flicker.start_threshold, flicker.stop_threshold)}};
  }
  return {};
}

Problem problem_of(const ActivityFilterOptions& activity) {
  const auto problem = [](const char* key, const char* rule, double limit, double value) {
    return Problem{{fmt::format("activity.{}", key), fmt::format("{}, {} ev/s; it is {} ev/s", rule, limit, value)}};
  };
  if (activity.lower_start <= 0 && activity.upper_stop <= 0)
    return {{"activity", "has no bound; set lower_start or upper_stop"}};
  if (activity.lower_stop > activity.lower_start)
    return problem("lower_stop", "must not be above lower_start", activity.lower_start, activity.lower_stop);
  if (activity.upper_start > activity.upper_stop)
    return problem("upper_start", "must not be above upper_stop", activity.upper_stop, activity.upper_start);
  if (activity.upper_stop > 0 && activity.lower_start >= activity.upper_stop)
    return problem("upper_stop", "must be above lower_start", activity.lower_start, activity.upper_stop);
  return {};
}

Problem problem_of(const RegionFilterOptions& region, int width, int height) {
  Problem problem;
  const auto require_inside = [&](const char* list, const auto& entries) {
    for (std::size_t i = 0; i < entries.size() && !problem; ++i) {
      const auto& entry = entries[i];
      if (entry.x < width && entry.y < height) continue;
      problem = {fmt::format("region.{}.{}", list, i),
                 fmt::format("({}, {}) lies outside the sensor of {} x {} px", entry.x, entry.y, width, height)};
    }
  };
  require_inside("windows", region.windows);
  require_inside("masked_pixels", region.masked_pixels);
  return problem;
}

}  // namespace

std::optional<FilterProblem> find_problem(const FilterOptions& options) {
  Problem problem;
  if (options.activity) problem = problem_of(*options.activity);
  if (options.anti_flicker && !problem) problem = problem_of(*options.anti_flicker);
  return problem;
}

std::optional<FilterProblem> find_problem(const FilterOptions& options, int width, int height) {
  Problem problem = find_problem(options);
  if (options.region && !problem) problem = problem_of(*options.region, width, height);
  return problem;
}

void refuse(const std::optional<FilterProblem>& problem, const std::string& prefix) {
  if (problem) throw UserError(prefix + problem->key + ": " + problem->problem);
}

}  // namespace esim::inline filters

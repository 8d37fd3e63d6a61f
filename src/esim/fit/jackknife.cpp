#include "esim/fit/jackknife.h"

#include <algorithm>

namespace esim::inline fit {

std::optional<std::vector<Jackknifed>> jackknife(
    const std::vector<bool>& used, const std::function<std::vector<double>(std::optional<std::size_t>)>& evaluate) {
  if (std::count(used.begin(), used.end(), true) < kFewestAreas) return std::nullopt;
  const std::vector<double> all = evaluate(std::nullopt);
  std::vector<std::vector<double>> without;
  for (std::size_t area = 0; area < used.size(); ++area) {
    if (used[area]) without.push_back(evaluate(area));
  }
  const auto m = static_cast<double>(without.size());
  std::vector<Jackknifed> result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    double mean = 0, squares = 0;
    for (const auto& values : without) mean += values[i] / m;
    for (const auto& values : without) squares += (values[i] - mean) * (values[i] - mean);
    result.push_back({all[i], std::sqrt((m - 1) / m * squares), student_quantile(m - 1)});
  }
  return result;
}

Estimate fraction_estimate(const char* name, std::uint64_t part, std::uint64_t all, const char* source) {
  if (all == 0) return Estimate::unknown(name, "", "no pixel has enough events around it");
  const auto n = static_cast<double>(all);
  const double p = static_cast<double>(part) / n, z = kNormalQuantile, z2 = z * z;
  const double centre = (p + z2 / (2 * n)) / (1 + z2 / n);
  const double half = z / (1 + z2 / n) * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  // At 0 and 1, the interval ends there, but for rounding.
  return Estimate::found(name, "", p, part == 0 ? 0.0 : centre - half, part == all ? 1.0 : centre + half, source);
}

}  // namespace esim::inline fit

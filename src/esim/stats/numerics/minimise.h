#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

namespace esim::inline stats {

/// A local minimum of a function by the simplex method of Nelder and Mead (Computer Journal 7, 1965). `steps` are the
/// sizes of the first simplex. Ends when all corners are within `tolerance` times the steps of the best one.
inline std::vector<double> minimise(const std::function<double(const std::vector<double>&)>& function,
                                    std::vector<double> start, const std::vector<double>& steps,
                                    double tolerance = 1e-4) {
  struct Corner {
    std::vector<double> at;
    double value;
  };
  const std::size_t n = start.size();
  std::vector<Corner> simplex{{start, function(start)}};
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<double> at = start;
    at[i] += steps[i];
    simplex.push_back({at, function(at)});
  }
  const auto by_value = [](const Corner& a, const Corner& b) { return a.value < b.value; };
  for (int iteration = 0; iteration < 2000; ++iteration) {
    std::sort(simplex.begin(), simplex.end(), by_value);
    double spread = 0;
    for (const Corner& corner : simplex) {
      for (std::size_t i = 0; i < n; ++i)
        spread = std::max(spread, std::abs(corner.at[i] - simplex[0].at[i]) / std::abs(steps[i]));
    }
    if (spread < tolerance) break;
    std::vector<double> centre(n);
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t i = 0; i < n; ++i) centre[i] += simplex[k].at[i] / static_cast<double>(n);
    }
    Corner& worst = simplex.back();
    const auto along = [&](double factor) {  // 1: the centre mirrors the worst corner
      Corner corner{centre, 0};
      for (std::size_t i = 0; i < n; ++i) corner.at[i] += factor * (centre[i] - worst.at[i]);
      corner.value = function(corner.at);
      return corner;
    };
    const Corner mirrored = along(1);
    if (mirrored.value < simplex[0].value) {
      const Corner further = along(2);
      worst = further.value < mirrored.value ? further : mirrored;
    } else if (mirrored.value < simplex[n - 1].value) {
      worst = mirrored;
    } else if (const Corner inner = along(mirrored.value < worst.value ? 0.5 : -0.5);
               inner.value < std::min(mirrored.value, worst.value)) {
      worst = inner;
    } else {
      for (std::size_t k = 1; k <= n; ++k) {
        for (std::size_t i = 0; i < n; ++i) simplex[k].at[i] += 0.5 * (simplex[0].at[i] - simplex[k].at[i]);
        simplex[k].value = function(simplex[k].at);
      }
    }
  }
  return std::min_element(simplex.begin(), simplex.end(), by_value)->at;
}

}  // namespace esim::inline stats

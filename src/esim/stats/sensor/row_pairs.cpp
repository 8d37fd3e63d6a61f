#include "esim/stats/sensor/row_pairs.h"

#include <cmath>
#include <limits>
#include <numeric>

namespace esim::inline stats {
namespace {

constexpr std::size_t kWaiting = RowPairs::kLongest_us / 4;  // distances at which pairs may be missing
constexpr double kFewest = 500;                              // pairs at the other distances
constexpr double kLeftAtEnd = 0.85;                          // of the pairs, at the end of kWaiting

}  // namespace

void RowPairs::add(std::int64_t t_us, std::uint16_t row) {
  if (row >= recent_.size()) recent_.resize(row + std::size_t{1});
  std::deque<Stamp>& recent = recent_[row];
  while (!recent.empty() && t_us - recent.front().t_us > static_cast<std::int64_t>(kLongest_us)) recent.pop_front();
  if (recent.empty() || recent.back().t_us < t_us) recent.push_back({t_us, 0});
  for (const Stamp& before : recent) {
    if (before.t_us < t_us) counts_[static_cast<std::size_t>(t_us - before.t_us - 1)] += before.events;
  }
  ++recent.back().events;
}

RowPairs::Wait RowPairs::wait() const {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto sum_of = [this](std::size_t from, std::size_t to) {
    return static_cast<double>(std::accumulate(counts_.begin() + static_cast<std::ptrdiff_t>(from),
                                               counts_.begin() + static_cast<std::ptrdiff_t>(to), std::uint64_t{0}));
  };
  const double others = sum_of(kWaiting, kLongest_us);
  if (others < kFewest) return {kNaN, kNaN};
  const double usual = others / static_cast<double>(kLongest_us - kWaiting);  // pairs at a distance
  const double near = sum_of(0, kWaiting), last = sum_of(kWaiting - 8, kWaiting) / 8;
  if (last < kLeftAtEnd * usual - 3 * std::sqrt(usual / 8)) return {kNaN, kNaN};
  // What is missing at less than half a us is as at 1 us.
  const double missing_at_once = 0.5 * (1 - static_cast<double>(counts_[0]) / usual);
  return {static_cast<double>(kWaiting) - near / usual + missing_at_once,
          std::sqrt(near / (usual * usual) + near * near / (usual * usual * others))};
}

}  // namespace esim::inline stats

#include "esim/stats/sensor/integer_histogram.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace esim::inline stats {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

void IntegerHistogram::add(const IntegerHistogram& other, std::uint64_t times) {
  if (other.counts_.size() > counts_.size()) counts_.resize(other.counts_.size());
  for (std::size_t i = 0; i < other.counts_.size(); ++i) counts_[i] += times * other.counts_[i];
  total_ += times * other.total_;
}

std::uint64_t IntegerHistogram::edge(std::size_t bin) {
  if (bin < kExact) return bin;
  const std::size_t shift = (bin >> kBits) - 1;
  return static_cast<std::uint64_t>(bin - (shift << kBits)) << shift;
}

double IntegerHistogram::fraction_below(std::uint64_t limit) const {
  if (total_ == 0) return kNaN;
  const auto end = counts_.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(limit, counts_.size()));
  return static_cast<double>(std::accumulate(counts_.begin(), end, std::uint64_t{0})) / static_cast<double>(total_);
}

double IntegerHistogram::value_at(std::uint64_t rank) const {
  std::size_t bin = 0;
  while (rank >= counts_[bin]) rank -= counts_[bin++];
  const auto low = static_cast<double>(edge(bin)), width = static_cast<double>(edge(bin + 1)) - low;
  if (width == 1) return low;
  return low + width * (static_cast<double>(rank) + 0.5) / static_cast<double>(counts_[bin]) - 0.5;
}

double IntegerHistogram::quantile(double fraction) const {
  if (total_ == 0) return kNaN;
  const double place = fraction * static_cast<double>(total_ - 1), rank = std::floor(place);
  const double low = value_at(static_cast<std::uint64_t>(rank));
  if (place == rank) return low;
  return low + (place - rank) * (value_at(static_cast<std::uint64_t>(rank) + 1) - low);
}

double ks_distance(const IntegerHistogram& a, const IntegerHistogram& b) {
  if (a.total() == 0 || b.total() == 0) return kNaN;
  double below_a = 0, below_b = 0, distance = 0;
  for (std::size_t i = 0; i < std::max(a.bins().size(), b.bins().size()); ++i) {
    if (i < a.bins().size()) below_a += static_cast<double>(a.bins()[i]);
    if (i < b.bins().size()) below_b += static_cast<double>(b.bins()[i]);
    distance = std::max(distance,
                        std::abs(below_a / static_cast<double>(a.total()) - below_b / static_cast<double>(b.total())));
  }
  return distance;
}

}  // namespace esim::inline stats

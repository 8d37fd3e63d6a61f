#include "esim/dataset/generators/magnitudes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>

#include "esim/core/error.h"

namespace esim::inline dataset {
namespace {

constexpr double kMaxMagnitude_px = 1e4;
constexpr std::size_t kMaxHistogramBins = 1000;

void normalise(std::vector<double>& fractions) {
  const double sum = std::accumulate(fractions.begin(), fractions.end(), 0.0);
  for (double& fraction : fractions) fraction /= sum;
}

/// Reads one line of a file; false for a blank line.
bool read_bin(const std::string& place, std::string line, MagnitudeHistogram& into) {
  line.erase(std::find(line.begin(), line.end(), '#'), line.end());
  std::istringstream words(line);
  std::string rest;
  if (!(words >> rest)) return false;
  words = std::istringstream(line);
  double low = 0, high = 0, weight = 0;
  if (!(words >> low >> high >> weight) || (words >> rest))
    throw UserError(place + ": must be three numbers, LOW HIGH WEIGHT");
  const double before = into.edges.empty() ? 0 : into.edges.back();
  if (low != before) throw UserError(fmt::format("{}: LOW is {} px, but must continue at {} px", place, low, before));
  if (!(high > low) || !(high <= kMaxMagnitude_px))
    throw UserError(
        fmt::format("{}: HIGH is {} px, but must be above {} and at most {} px", place, high, low, kMaxMagnitude_px));
  if (!(weight >= 0) || !std::isfinite(weight))
    throw UserError(fmt::format("{}: WEIGHT is {}, but must be at least 0", place, weight));
  if (into.bins() == kMaxHistogramBins)
    throw UserError(fmt::format("{}: has more than {} bins; merge some", place, kMaxHistogramBins));
  if (into.edges.empty()) into.edges.push_back(0);
  into.edges.push_back(high);
  into.fractions.push_back(weight);
  return true;
}

}  // namespace

std::size_t MagnitudeHistogram::bin_of(double magnitude) const {
  const auto above = std::upper_bound(edges.begin(), edges.end(), magnitude);
  return static_cast<std::size_t>(above - edges.begin()) - 1;
}

double MagnitudeHistogram::quantile(double u) const {
  for (std::size_t i = 0; i < bins(); ++i) {
    if (u < fractions[i]) return edges[i] + u / fractions[i] * (edges[i + 1] - edges[i]);
    u -= fractions[i];
  }
  return edges.back();  // rounding
}

MagnitudeHistogram MagnitudeHistogram::scaled(double factor) const {
  MagnitudeHistogram result = *this;
  for (double& edge : result.edges) edge *= factor;
  return result;
}

MagnitudeHistogram sintel_magnitudes() {
  constexpr double kMedian_px = 7.334, kSigma = 1.5844;  // of the distribution before truncation
  constexpr double kLast_px = 160;
  constexpr int kBins = 21;
  const auto below = [](double px) { return 0.5 * std::erfc(-std::log(px / kMedian_px) / (kSigma * std::sqrt(2.0))); };
  MagnitudeHistogram result;
  result.source = "MPI Sintel";
  result.edges = {0};
  for (int i = 0; i < kBins; ++i) {  // two bins per doubling
    result.edges.push_back(kLast_px * std::exp2(-0.5 * (kBins - 1 - i)));
    const double before = result.edges.end()[-2];
    result.fractions.push_back(below(result.edges.back()) - (before > 0 ? below(before) : 0.0));
  }
  normalise(result.fractions);
  return result;
}

MagnitudeHistogram read_magnitudes(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw UserError(file.string() + ": cannot be read; must be a file of lines LOW HIGH WEIGHT");
  MagnitudeHistogram result;
  result.source = file.filename().string();
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number)
    read_bin(fmt::format("{}:{}", file.string(), number), line, result);
  if (!(std::accumulate(result.fractions.begin(), result.fractions.end(), 0.0) > 0))
    throw UserError(file.string() + ": needs at least one line LOW HIGH WEIGHT with a weight above 0");
  normalise(result.fractions);
  return result;
}

double total_variation(const std::vector<double>& a, const std::vector<double>& b) {
  return 0.5 * std::transform_reduce(a.begin(), a.end(), b.begin(), 0.0, std::plus<>(),
                                     [](double x, double y) { return std::fabs(x - y); });
}

}  // namespace esim::inline dataset

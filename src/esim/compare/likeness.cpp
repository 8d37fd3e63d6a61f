#include "esim/compare/likeness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "esim/core/random.h"

namespace esim::inline compare {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kDraws = 200;
constexpr std::size_t kFewestParts = 8;

using Kind = ComparedStatistic::Kind;

/// How often each of `parts` is drawn, of `draws` in all.
std::vector<std::uint64_t> draw_parts(std::size_t parts, std::size_t draws, std::uint16_t stream, std::uint32_t item) {
  const AddressedRandom random(0, Purpose::resampling, stream);
  std::vector<std::uint64_t> times(parts);
  for (std::size_t k = 0; k < draws; ++k) {
    const double u = random.uniforms(item, k)[0];
    ++times[std::min(parts - 1, static_cast<std::size_t>(u * static_cast<double>(parts)))];
  }
  return times;
}

/// The statistics of blocks of time, areas and quiet areas that are drawn with replacement, without a scan.
SensorStatistics resample(const SensorStatistics& s, std::uint16_t stream, std::uint32_t item) {
  SensorStatistics drawn;
  drawn.sensor = s.sensor, drawn.stamp_unit = s.stamp_unit;
  drawn.quiet.duration_s = s.quiet.duration_s;
  const auto times = draw_parts(s.blocks.size(), s.blocks.size(), stream, item);
  for (std::size_t i = 0; i < s.blocks.size(); ++i) {
    const double left_s = s.duration_s - static_cast<double>(i) * s.block_s;  // the last block is shorter
    drawn.duration_s += static_cast<double>(times[i]) * std::min(s.block_s, left_s);
    if (times[i] > 0) drawn.StreamSums::add(s.blocks[i], times[i]);
  }
  const auto areas = draw_parts(s.tiles.size(), s.tiles.size(), stream + 1, item);
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (areas[i] > 0) drawn.PixelSums::add(s.tiles[i], areas[i]);
  }
  const auto quiet = draw_parts(s.quiet.blocks.size(), s.quiet.blocks.size(), stream + 2, item);
  for (std::size_t i = 0; i < quiet.size(); ++i) {
    drawn.quiet.all.pixels += quiet[i] * s.quiet.blocks[i].pixels;
    drawn.quiet.all.events += quiet[i] * s.quiet.blocks[i].events;
  }
  return drawn;
}

struct Scatter {
  double mean = 0, deviation = 0, low = 0, high = 0;
};

Scatter scatter_of(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.size() < kDraws / 2) return {kNaN, kNaN, kNaN, kNaN};
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  Scatter scatter;
  for (const double value : values) scatter.mean += value / n;
  for (const double value : values) scatter.deviation += (value - scatter.mean) * (value - scatter.mean) / (n - 1);
  scatter.deviation = std::sqrt(scatter.deviation);
  scatter.low = values[static_cast<std::size_t>(0.025 * n)];
  scatter.high = values[static_cast<std::size_t>(0.975 * n)];
  return scatter;
}

double deviations(double distance, double deviation) {
  if (std::isnan(distance) || std::isnan(deviation)) return kNaN;
  if (distance == 0) return 0;
  return deviation > 0 ? std::abs(distance) / deviation : kInfinity;
}

bool has_parts(const std::vector<StreamSums>& blocks) {
  return std::count_if(blocks.begin(), blocks.end(), [](const auto& block) { return block.events > 0; }) >=
         static_cast<std::ptrdiff_t>(kFewestParts);
}

bool has_parts(const std::vector<PixelSums>& tiles) {
  return std::count_if(tiles.begin(), tiles.end(), [](const auto& tile) { return tile.counts_on.total() > 0; }) >=
         static_cast<std::ptrdiff_t>(kFewestParts);
}

/// Compares one number, with its values in the draws.
ComparedStatistic compare_values(const NamedValue& first, const NamedValue& second,
                                 const std::vector<std::vector<NamedValue>>& drawn_first,
                                 const std::vector<std::vector<NamedValue>>& drawn_second, std::size_t index) {
  const bool is_ratio = first.comparison == Comparison::ratio;
  const auto difference = [is_ratio](double a, double b) {  // of the logarithms for a ratio
    if (!is_ratio) return b - a;
    return a > 0 && b > 0 ? std::log(b / a) : a == b ? 0.0 : kNaN;
  };
  ComparedStatistic result{std::string(first.name),
                           std::string(first.unit),
                           is_ratio ? Kind::ratio : Kind::difference,
                           first.value,
                           second.value,
                           kNaN,
                           kNaN,
                           kNaN,
                           kNaN};
  const double distance = difference(first.value, second.value);
  result.distance = is_ratio ? std::exp(distance) : distance;
  if (drawn_first.empty()) return result;
  std::vector<double> scattered;
  for (std::size_t k = 0; k < drawn_first.size(); ++k)
    scattered.push_back(difference(drawn_first[k][index].value, drawn_second[k][index].value));
  const Scatter scatter = scatter_of(std::move(scattered));
  result.low = is_ratio ? std::exp(scatter.low) : scatter.low;
  result.high = is_ratio ? std::exp(scatter.high) : scatter.high;
  result.deviations = deviations(distance, scatter.deviation);
  return result;
}

/// Compares a distribution of which there are sums of parts.
template <typename Part>
ComparedStatistic compare_distributions(const char* name, const std::vector<Part>& first,
                                        const std::vector<Part>& second, IntegerHistogram Part::*histogram,
                                        std::uint16_t stream) {
  const auto drawn = [&](const std::vector<std::uint64_t>& times) {  // of the parts of both together
    IntegerHistogram sum;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const Part& part = i < first.size() ? first[i] : second[i - first.size()];
      if (times[i] > 0) sum.add(part.*histogram, times[i]);
    }
    return sum;
  };
  const auto times_of = [&](bool in_first, bool in_second) {
    std::vector<std::uint64_t> times(first.size() + second.size());
    std::fill_n(times.begin(), first.size(), in_first);
    std::fill(times.begin() + static_cast<std::ptrdiff_t>(first.size()), times.end(), in_second);
    return times;
  };
  ComparedStatistic result{name, "", Kind::distribution, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN};
  result.distance = ks_distance(drawn(times_of(true, false)), drawn(times_of(false, true)));
  if (!has_parts(first) || !has_parts(second)) return result;
  std::vector<double> apart, together;
  for (std::uint32_t k = 0; k < kDraws; ++k) {
    std::vector<std::uint64_t> a = draw_parts(first.size(), first.size(), stream, k);
    std::vector<std::uint64_t> b(first.size());
    a.resize(first.size() + second.size());
    const auto drawn_b = draw_parts(second.size(), second.size(), stream + 1, k);
    b.insert(b.end(), drawn_b.begin(), drawn_b.end());
    apart.push_back(ks_distance(drawn(a), drawn(b)));
    const std::size_t all = first.size() + second.size();
    together.push_back(ks_distance(drawn(draw_parts(all, first.size(), stream + 2, k)),
                                   drawn(draw_parts(all, second.size(), stream + 3, k))));
  }
  const Scatter interval = scatter_of(std::move(apart)), chance = scatter_of(std::move(together));
  result.low = interval.low, result.high = interval.high;
  result.deviations = deviations(std::max(0.0, result.distance - chance.mean), chance.deviation);
  return result;
}

}  // namespace

std::vector<ComparedStatistic> compare_sensors(const SensorStatistics& first, const SensorStatistics& second) {
  std::vector<std::vector<NamedValue>> drawn_first, drawn_second;
  if (has_parts(first.blocks) && has_parts(second.blocks)) {
    for (std::uint32_t k = 0; k < kDraws; ++k) {
      drawn_first.push_back(values_of(resample(first, 0, k)));
      drawn_second.push_back(values_of(resample(second, 8, k)));
    }
  }
  std::vector<ComparedStatistic> result;
  const std::vector<NamedValue> a = values_of(first), b = values_of(second);
  for (std::size_t i = 0; i < a.size(); ++i) result.push_back(compare_values(a[i], b[i], drawn_first, drawn_second, i));
  if (first.scan.has_value() != second.scan.has_value()) {
    for (ComparedStatistic& statistic : result) {
      if (statistic.name == kScanPeriod) statistic.deviations = kInfinity;
    }
  }
  result.push_back(compare_distributions("intervals", first.blocks, second.blocks, &StreamSums::intervals_us, 16));
  result.push_back(compare_distributions("ON events of a pixel", first.tiles, second.tiles, &PixelSums::counts_on, 20));
  result.push_back(
      compare_distributions("OFF events of a pixel", first.tiles, second.tiles, &PixelSums::counts_off, 24));
  return result;
}

std::vector<const ComparedStatistic*> distinguishing(const std::vector<ComparedStatistic>& statistics) {
  std::vector<const ComparedStatistic*> found;
  for (const ComparedStatistic& statistic : statistics) {
    if (statistic.distinguishes()) found.push_back(&statistic);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto* a, const auto* b) { return a->deviations > b->deviations; });
  return found;
}

}  // namespace esim::inline compare

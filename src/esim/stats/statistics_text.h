#pragma once

#include <span>
#include <string>
#include <vector>

#include "esim/stats/event_statistics.h"

namespace esim::inline stats {

/// Statistics of one file, with the name to show.
struct NamedStatistics {
  std::string name;
  Statistics statistics;
};

/// A line of text: label, and value with unit. A line without a label continues the previous one.
struct StatisticsLine {
  std::string label, value;
};

/// A group of lines.
struct StatisticsSection {
  std::string title;
  std::vector<StatisticsLine> lines;
};

/// The statistics as text: always the same sections with the same lines.
std::vector<StatisticsSection> statistics_sections(const Statistics& statistics);

/// The same as aligned plain text, with one column per file.
std::string describe(std::span<const NamedStatistics> files);

/// The same as JSON, in SI units without prefixes; null for missing values.
std::string to_json(const NamedStatistics& file);

/// Three significant digits with the unit's prefix: 1.23 Mev/s, 45.6 us, 0 ev/s.
std::string format_rate(double per_second);
std::string format_duration(double seconds);

/// The result of the banding test, such as "no banding", with the p-value.
std::string verdict(const Statistics& statistics);

}  // namespace esim::inline stats

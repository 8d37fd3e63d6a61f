#pragma once

#include <span>
#include <string>
#include <vector>

#include "esim/stats/event_statistics.h"

namespace esim {

/// Statistics of one file, with the name to show.
struct NamedStatistics {
  std::string name;
  Statistics statistics;
};

/// A line of text: what it is, and its value with unit. Without a label it continues the one above.
struct ReportLine {
  std::string label, value;
};

/// A few lines that belong together.
struct ReportSection {
  std::string title;
  std::vector<ReportLine> lines;
};

/// What the statistics tell, for people: always the same sections with the same lines.
std::vector<ReportSection> report_sections(const Statistics& statistics);

/// The same as plain text, aligned, one column for each of the files.
std::string describe(std::span<const NamedStatistics> files);

/// The same as JSON, in SI units without prefixes; null where there is no value.
std::string to_json(const NamedStatistics& file);

/// Three significant digits with the unit's prefix: 1.23 Mev/s, 45.6 us, 0 ev/s.
std::string format_rate(double per_second);
std::string format_duration(double seconds);

/// "no banding" and the like, with the p-value.
std::string verdict(const Statistics& statistics);

}  // namespace esim

#include "esim/stats/statistics_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "esim/files/number_text.h"

namespace esim::inline stats {
namespace {

constexpr std::size_t kListedHotPixels = 5;

// Three significant digits, as 1.23, 45.6 or 789.
std::string three_digits(double value) {
  const double magnitude = std::abs(value);
  return fmt::format("{:.{}f}", value, magnitude >= 99.95 ? 0 : magnitude >= 9.995 ? 1 : 2);
}

std::string percent(double fraction) { return fmt::format("{:.3g} %", 100 * fraction); }

double ratio(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::string p_text(double p) { return p < 1e-300 ? "p < 1e-300" : fmt::format("p = {:.2g}", p); }

// Probability that any of the searched frequencies is this strong by chance.
std::string corrected_p_text(const Periodicity& periodicity) {
  return fmt::format("{}, corrected for {} frequencies", p_text(periodicity.p_value), grouped(periodicity.candidates));
}

double mean_count(const Statistics& s) {
  return s.counts.empty() ? 0.0 : static_cast<double>(s.events()) / static_cast<double>(s.counts.size());
}

StatisticsSection stream_section(const Statistics& s) {
  StatisticsSection section{"stream", {}};
  section.lines.push_back({"events", grouped(s.events())});
  section.lines.push_back(
      {"ON, OFF", fmt::format("{:.1f} %, {:.1f} %", 100 * ratio(s.on, s.events()), 100 * ratio(s.off, s.events()))});
  section.lines.push_back({"ON / OFF", s.off == 0 ? "-" : fmt::format("{:.3f}", ratio(s.on, s.off))});
  section.lines.push_back({"duration", format_duration(s.duration_s())});
  section.lines.push_back({"first, last", fmt::format("{:.6f} s, {:.6f} s", to_seconds(s.first), to_seconds(s.last))});
  section.lines.push_back({"mean rate", format_rate(s.mean_rate_hz())});
  section.lines.push_back({"peak in 10 ms", format_rate(static_cast<double>(s.rate.max_in_10_ms()) / 10e-3)});
  section.lines.push_back({"peak in 1 ms", format_rate(static_cast<double>(s.rate.max_in_1_ms()) / 1e-3)});
  return section;
}

StatisticsSection pixel_section(const Statistics& s) {
  StatisticsSection section{"pixels", {}};
  section.lines.push_back({"sensor", fmt::format("{} x {} px", s.sensor.width, s.sensor.height)});
  section.lines.push_back({"counts", fmt::format("mean {}, median {:g}, max {} events", three_digits(mean_count(s)),
                                                 s.median_count, grouped(s.largest_count))});
  section.lines.push_back({"mean rate", format_rate(mean_count(s) * s.per_second(1))});
  section.lines.push_back({"silent", percent(ratio(s.silent_pixels, s.counts.size()))});
  section.lines.push_back({"hot", s.hot_pixels.empty() ? "none" : grouped(s.hot_pixels.size())});
  for (std::size_t i = 0; i < std::min(s.hot_pixels.size(), kListedHotPixels); ++i) {
    const HotPixel& pixel = s.hot_pixels[i];
    section.lines.push_back(
        {"", fmt::format("({}, {})  {}", pixel.x, pixel.y, format_rate(s.per_second(pixel.events)))});
  }
  return section;
}

StatisticsSection interval_section(const Statistics& s) {
  const IntervalHistogram& intervals = s.intervals;
  const bool any = intervals.total() > 0;
  const auto quantile = [&](double fraction) -> std::string {
    if (!any) return "-";
    const double seconds = intervals.quantile_s(fraction);
    return seconds < IntervalHistogram::edge_s(0) ? "< 1 us" : format_duration(seconds);
  };
  return {"time between events of a pixel",
          {{"shortest", any ? format_duration(to_seconds(intervals.shortest())) : "-"},
           {"1 % below", quantile(0.01)},
           {"median", quantile(0.5)},
           {"99 % below", quantile(0.99)}}};
}

std::string period_text(const Statistics& s) {
  if (!s.phase) return "-";
  const double f = s.phase->frequency_hz;
  return fmt::format("{} ({:.6g} Hz), {}", format_duration(1 / f), f, s.periodicity ? "strongest found" : "given");
}

StatisticsSection stamp_section(const Statistics& s) {
  StatisticsSection section{"time stamps", {}};
  const auto line = [&](const char* label, const std::string& value) { section.lines.push_back({label, value}); };
  line("distinct",
       fmt::format("{} ({} of the events)", grouped(s.distinct_times), percent(ratio(s.distinct_times, s.events()))));
  line("simultaneous", fmt::format("{} of the events, at most {} at the same time",
                                   percent(ratio(s.simultaneous, s.events())), grouped(s.max_simultaneous)));
  line("period", period_text(s));
  line("Rayleigh",
       s.periodicity ? fmt::format("z = {:.4g}, {}", s.periodicity->rayleigh, corrected_p_text(*s.periodicity)) : "-");
  const PhaseTest phase = s.phase.value_or(PhaseTest{});
  const bool tested = phase.banding != Banding::unknown && (!s.periodicity || s.periodicity->found());
  line("chi2 / dof", tested ? fmt::format("{:.4g} (nearby periods: {:.4g}), {}", phase.chi2_per_dof,
                                          phase.neighbours_chi2_per_dof, p_text(phase.p_value))
                            : "-");
  line("modulation", tested ? percent(phase.modulation) + " rms" : "-");
  line("within 1 % of peak", tested ? percent(phase.fraction_at_peak) + " of the events (uniform: 2 %)" : "-");
  line("verdict", verdict(s));
  return section;
}

void append_line(std::string& text, const std::string& label, const std::vector<std::string>& values,
                 const std::vector<std::size_t>& widths) {
  std::string line = fmt::format("  {:<20}", label);
  for (std::size_t i = 0; i < values.size(); ++i) line += fmt::format("{:<{}}", values[i], widths[i] + 3);
  line.erase(line.find_last_not_of(' ') + 1);
  text += line + "\n";
}

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

const char* banding_word(Banding banding) {
  constexpr std::array<const char*, 4> kWords = {"none", "weak", "strong", "unknown"};
  return kWords[static_cast<std::size_t>(banding)];
}

nlohmann::ordered_json stamps_json(const Statistics& s) {
  nlohmann::ordered_json stamps = {{"distinct", s.distinct_times},
                                   {"distinct_per_event", ratio(s.distinct_times, s.events())},
                                   {"simultaneous_fraction", ratio(s.simultaneous, s.events())},
                                   {"max_simultaneous", s.max_simultaneous},
                                   {"period_given", !s.periodicity},
                                   {"rayleigh_z", nullptr},
                                   {"rayleigh_p", nullptr},
                                   {"rayleigh_candidates", nullptr},
                                   {"banding", banding_word(s.banding())}};
  if (s.periodicity) {
    stamps["rayleigh_z"] = s.periodicity->rayleigh;
    stamps["rayleigh_p"] = s.periodicity->p_value;
    stamps["rayleigh_candidates"] = s.periodicity->candidates;
  }
  if (s.phase) {
    stamps["frequency_hz"] = s.phase->frequency_hz;
    stamps["tested_events"] = s.phase->events;
    stamps["chi2_per_dof"] = s.phase->chi2_per_dof;
    stamps["neighbours_chi2_per_dof"] = s.phase->neighbours_chi2_per_dof;
    stamps["p_value"] = s.phase->p_value;
    stamps["modulation_rms"] = s.phase->modulation;
    stamps["fraction_within_1_percent_of_peak"] = s.phase->fraction_at_peak;
    stamps["phase_histogram"] = s.phase->histogram;
  }
  return stamps;
}

}  // namespace

std::string format_rate(double per_second) {
  constexpr std::array<const char*, 4> kUnits = {"ev/s", "kev/s", "Mev/s", "Gev/s"};
  std::size_t unit = 0;
  for (; per_second >= 999.5 && unit + 1 < kUnits.size(); ++unit) per_second /= 1000;
  return fmt::format("{} {}", three_digits(per_second), kUnits[unit]);
}

std::string format_duration(double seconds) {
  constexpr std::array<const char*, 4> kUnits = {"ns", "us", "ms", "s"};
  double value = 1e9 * seconds;
  std::size_t unit = 0;
  for (; value >= 999.5 && unit + 1 < kUnits.size(); ++unit) value /= 1000;
  return unit == 0 ? fmt::format("{:.0f} ns", value) : fmt::format("{} {}", three_digits(value), kUnits[unit]);
}

std::string verdict(const Statistics& s) {
  switch (s.banding()) {
    case Banding::strong:
      return fmt::format("time stamps show banding at {} ({})", s.periodicity ? "this period" : "the frame times",
                         p_text(s.phase->p_value));
    case Banding::weak:
      return fmt::format("time stamps follow the period weakly ({})", p_text(s.phase->p_value));
    case Banding::none:
      if (s.periodicity && !s.periodicity->found()) {
        return fmt::format("no banding: no period found ({})", corrected_p_text(*s.periodicity));
      }
      return fmt::format("no banding ({})", p_text(s.phase->p_value));
    case Banding::unknown:
      break;
  }
  return "too few events or periods to tell";
}

std::vector<StatisticsSection> statistics_sections(const Statistics& statistics) {
  return {stream_section(statistics), pixel_section(statistics), interval_section(statistics),
          stamp_section(statistics)};
}

std::string describe(std::span<const NamedStatistics> files) {
  std::vector<std::vector<StatisticsSection>> reports;
  std::vector<std::string> names;
  std::vector<std::size_t> widths;
  for (const NamedStatistics& file : files) {
    reports.push_back(statistics_sections(file.statistics));
    names.push_back(file.name);
    widths.push_back(file.name.size());
    for (const StatisticsSection& section : reports.back()) {
      for (const StatisticsLine& line : section.lines) widths.back() = std::max(widths.back(), line.value.size());
    }
  }
  std::string text;
  append_line(text, "", names, widths);
  for (std::size_t section = 0; section < reports.front().size(); ++section) {
    text += reports.front()[section].title + "\n";
    std::size_t lines = 0;
    for (const auto& report : reports) lines = std::max(lines, report[section].lines.size());
    for (std::size_t line = 0; line < lines; ++line) {
      std::string label;
      std::vector<std::string> values;
      for (const auto& report : reports) {
        const auto& own = report[section].lines;
        values.push_back(line < own.size() ? own[line].value : "");
        if (line < own.size()) label = own[line].label;
      }
      append_line(text, label, values, widths);
    }
  }
  return text;
}

std::string to_json(const NamedStatistics& file) {
  using Json = nlohmann::ordered_json;
  const Statistics& s = file.statistics;
  Json hot = Json::array();
  for (const HotPixel& pixel : s.hot_pixels) {
    hot.push_back({{"x", pixel.x}, {"y", pixel.y}, {"rate_hz", s.per_second(pixel.events)}});
  }
  const IntervalHistogram& intervals = s.intervals;
  const double shortest_s = intervals.total() > 0 ? to_seconds(intervals.shortest()) : std::nan("");
  const Json json = {
      {"file", file.name},
      {"stream",
       {{"events", s.events()},
        {"on", s.on},
        {"off", s.off},
        {"first_s", to_seconds(s.first)},
        {"last_s", to_seconds(s.last)},
        {"duration_s", s.duration_s()},
        {"mean_rate_hz", s.mean_rate_hz()},
        {"peak_rate_10_ms_hz", static_cast<double>(s.rate.max_in_10_ms()) / 10e-3},
        {"peak_rate_1_ms_hz", static_cast<double>(s.rate.max_in_1_ms()) / 1e-3}}},
      {"pixels",
       {{"width", s.sensor.width},
        {"height", s.sensor.height},
        {"mean_events", mean_count(s)},
        {"median_events", s.median_count},
        {"max_events", s.largest_count},
        {"silent_fraction", ratio(s.silent_pixels, s.counts.size())},
        {"hot", hot}}},
      {"intervals",
       {{"number", intervals.total()},
        {"shortest_s", number_or_null(shortest_s)},
        {"quantile_1_percent_s", number_or_null(intervals.quantile_s(0.01))},
        {"median_s", number_or_null(intervals.quantile_s(0.5))},
        {"quantile_99_percent_s", number_or_null(intervals.quantile_s(0.99))}}},
      {"time_stamps", stamps_json(s)},
  };
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace esim::inline stats

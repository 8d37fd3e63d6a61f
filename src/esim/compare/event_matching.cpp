#include "esim/compare/event_matching.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline compare {
namespace {

enum class Step : std::uint8_t { pair, missing, spurious };

bool same_polarities(std::span<const PixelEvent> a, std::span<const PixelEvent> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PixelEvent& x, const PixelEvent& y) { return x.polarity == y.polarity; });
}

}  // namespace

EventsByPixel::EventsByPixel(EventSpan events, int width, int height)
    : first_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) + 1), events_(events.size()) {
  const auto pixel_of = [&](const Event& e) { return std::size_t{e.y} * static_cast<std::size_t>(width) + e.x; };
  for (const Event& e : events) ++first_[pixel_of(e) + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (const Event& e : events) events_[next[pixel_of(e)]++] = {e.t, e.polarity};
}

EventMatch match_events(std::span<const PixelEvent> reference, std::span<const PixelEvent> events) {
  EventMatch match;
  const auto pair = [&](std::size_t i, std::size_t j) {
    match.differences_s.push_back(to_seconds(events[j].t - reference[i].t));
  };
  match.identical = same_polarities(reference, events);
  if (match.identical) {
    for (std::size_t i = 0; i < reference.size(); ++i) pair(i, i);
    return match;
  }
  // A state (i, j) means that the first i and j events have their counterparts or none; its cost is the lowest. Events
  // further apart than `reach` are never a pair, so that of row i only the columns from first[i] to last[i] are needed.
  constexpr TimeNs reach = 2 * kUnmatchedCost;
  const std::size_t rows = reference.size() + 1;
  std::vector<std::size_t> first(rows), last(rows, events.size()), begin(rows + 1);
  const auto before = [&](TimeNs t) {  // number of events before t
    const auto end =
        std::partition_point(events.begin(), events.end(), [t](const PixelEvent& event) { return event.t < t; });
    return static_cast<std::size_t>(end - events.begin());
  };
  for (std::size_t i = 0; i < rows; ++i) {
    if (i > 0) first[i] = before(reference[i - 1].t - reach);
    if (i + 1 < rows) last[i] = before(reference[i].t + reach + 1);
    begin[i + 1] = begin[i] + last[i] - first[i] + 1;
  }
  std::vector<Step> step(begin[rows]);  // the last step to each state
  std::vector<TimeNs> cost, above;      // of row i, and of the row before
  for (std::size_t i = 0; i < rows; ++i) {
    above.swap(cost);
    cost.assign(last[i] - first[i] + 1, std::numeric_limits<TimeNs>::max());
    const auto is_above = [&](std::size_t j) { return i > 0 && j >= first[i - 1] && j <= last[i - 1]; };
    if (i == 0) cost[0] = 0;
    for (std::size_t j = first[i]; j <= last[i]; ++j) {
      TimeNs& best = cost[j - first[i]];
      const auto consider = [&](TimeNs total, Step way) {
        if (total >= best) return;
        best = total;
        step[begin[i] + j - first[i]] = way;
      };
      if (j > 0 && is_above(j - 1) && reference[i - 1].polarity == events[j - 1].polarity)
        consider(above[j - 1 - first[i - 1]] + std::abs(events[j - 1].t - reference[i - 1].t), Step::pair);
      if (is_above(j)) consider(above[j - first[i - 1]] + kUnmatchedCost, Step::missing);
      if (j > first[i]) consider(cost[j - 1 - first[i]] + kUnmatchedCost, Step::spurious);
    }
  }
  for (std::size_t i = rows - 1, j = events.size(); i + j > 0;) {
    switch (step[begin[i] + j - first[i]]) {
      case Step::pair:
        pair(--i, --j);
        break;
      case Step::missing:
        ++match.missing, --i;
        break;
      case Step::spurious:
        ++match.spurious, --j;
        break;
    }
  }
  return match;
}

EventComparison compare_events(const EventsByPixel& reference, const EventsByPixel& events) {
  EventComparison all;
  all.reference = static_cast<std::int64_t>(reference.events());
  all.events = static_cast<std::int64_t>(events.events());
  std::vector<double> errors_s;
  for (std::size_t pixel = 0; pixel < reference.pixels(); ++pixel) {
    if (reference.of(pixel).empty() && events.of(pixel).empty()) continue;
    const EventMatch match = match_events(reference.of(pixel), events.of(pixel));
    ++all.active_pixels;
    all.identical_pixels += match.identical ? 1 : 0;
    all.missing += match.missing;
    all.spurious += match.spurious;
    for (const double difference_s : match.differences_s) errors_s.push_back(std::abs(difference_s));
  }
  all.matched = static_cast<std::int64_t>(errors_s.size());
  if (errors_s.empty()) return all;
  std::sort(errors_s.begin(), errors_s.end());
  for (std::size_t percent = 0; percent <= 100; ++percent)
    all.quantiles_s.push_back(errors_s[percent * (errors_s.size() - 1) / 100]);
  all.median_s = all.quantiles_s[50];
  all.p95_s = all.quantiles_s[95];
  return all;
}

}  // namespace esim::inline compare

#include "esim/stats/sensor/frame_times.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "esim/stats/numerics/median.h"

namespace esim::inline stats {
namespace {

// A burst is compared with the times before and after it.
constexpr TimeNs kBurst = 150 * kNsPerUs, kSkipped = 200 * kNsPerUs, kBefore = kNsPerMs;
constexpr TimeNs kStep = 20 * kNsPerUs;
constexpr TimeNs kFine = 50 * kNsPerUs;        // windows on both sides of an onset
constexpr TimeNs kTolerance = 300 * kNsPerUs;  // of periods and exposures
constexpr TimeNs kShortestExposure = 200 * kNsPerUs;
constexpr double kCertain = 6;  // standard deviations

/// Events of one polarity.
class Times {
 public:
  Times(EventSpan events, bool on) {
    for (const Event& event : events) {
      if ((event.polarity > 0) == on) times_.push_back(event.t);
    }
  }

  double within(TimeNs from, TimeNs to) const {
    const auto at = [&](TimeNs t) { return std::lower_bound(times_.begin(), times_.end(), t); };
    return static_cast<double>(at(to) - at(from));
  }

 private:
  std::vector<TimeNs> times_;
};

/// The first time with all of the time before it that a burst is compared with.
TimeNs first_possible(EventSpan events) { return events.front().t + kSkipped + kBefore; }

/// The events from t on, beyond those expected from the time before.
BurstEvents beyond_expected(const Times& times, TimeNs t, TimeNs duration) {
  const double part = static_cast<double>(duration) / static_cast<double>(kBefore);
  const double there = times.within(t, t + duration), before = times.within(t - kSkipped - kBefore, t - kSkipped);
  return {there - part * before, std::sqrt(there + part * part * before)};
}

/// The onsets of certain bursts: their events, in standard deviations of what is expected, stand out from those of all
/// other times by kCertain. A lasting change of the rate is no burst.
std::vector<TimeNs> find_onsets(EventSpan events, bool on) {
  const Times times(events, on);
  struct Window {
    TimeNs t = 0;
    double score = 0;
  };
  std::vector<Window> windows;
  std::vector<double> sizes;
  const double part = static_cast<double>(kBurst) / static_cast<double>(kBefore);
  const TimeNs last = events.back().t - kBurst - kSkipped - kBefore;
  for (TimeNs t = first_possible(events); t <= last; t += kStep) {
    const TimeNs after = t + kBurst + kSkipped;
    const double expected =
        part * std::max(times.within(t - kSkipped - kBefore, t - kSkipped), times.within(after, after + kBefore));
    const double beyond = times.within(t, t + kBurst) - expected;
    windows.push_back({t, beyond / std::sqrt(expected * (1 + part) + 1)});
    sizes.push_back(std::abs(windows.back().score));
  }
  if (windows.empty()) return {};
  const double scatter = std::max(1.0, median(sizes) / 0.6745);
  std::erase_if(windows, [&](const Window& window) { return window.score < kCertain * scatter; });
  std::sort(windows.begin(), windows.end(), [](const Window& a, const Window& b) { return a.score > b.score; });
  std::vector<TimeNs> onsets;
  for (const Window& window : windows) {
    const bool is_known =
        std::any_of(onsets.begin(), onsets.end(), [&](TimeNs onset) { return std::abs(onset - window.t) < kBefore; });
    if (is_known) continue;
    TimeNs best = window.t;
    const auto rise = [&](TimeNs t) { return times.within(t, t + kFine) - times.within(t - kFine, t); };
    for (TimeNs t = window.t - kFine; t <= window.t + kBurst; t += kStep / 2) {
      if (rise(t) > rise(best)) best = t;
    }
    onsets.push_back(best);
  }
  std::sort(onsets.begin(), onsets.end());
  return onsets;
}

/// The period of which all differences are multiples, if they are.
std::optional<TimeNs> period_of(const std::vector<TimeNs>& onsets) {
  TimeNs shortest = onsets[1] - onsets[0];
  for (std::size_t i = 2; i < onsets.size(); ++i) shortest = std::min(shortest, onsets[i] - onsets[i - 1]);
  TimeNs periods = 0;
  for (std::size_t i = 1; i < onsets.size(); ++i) {
    const TimeNs difference = onsets[i] - onsets[i - 1], count = (difference + shortest / 2) / shortest;
    if (std::abs(difference - count * shortest) > kTolerance) return std::nullopt;
    periods += count;
  }
  return (onsets.back() - onsets.front()) / periods;
}

/// The repetitions of a time at which events may be compared with those before.
std::vector<TimeNs> repetitions(TimeNs time, std::optional<TimeNs> period, EventSpan events) {
  const TimeNs first = first_possible(events), last = events.back().t - kBurst;
  std::vector<TimeNs> times;
  if (!period) {
    if (time >= first && time <= last) times.push_back(time);
    return times;
  }
  time -= (time - first) / *period * *period;
  for (; time <= last; time += *period) {
    if (time >= first) times.push_back(time);
  }
  return times;
}

}  // namespace

FrameTimes FrameTimes::since(TimeNs moment) const {
  FrameTimes later = *this;
  if (later.start) *later.start -= moment;
  if (later.end) *later.end -= moment;
  return later;
}

std::optional<FrameTimes> find_frames(EventSpan events) {
  if (events.empty()) return std::nullopt;
  const std::vector<TimeNs> starts = find_onsets(events, false), ends = find_onsets(events, true);
  if (starts.empty() && ends.empty()) return std::nullopt;
  FrameTimes frames;
  for (const std::vector<TimeNs>& onsets : {ends, starts}) {
    if (onsets.size() < 2) continue;
    const std::optional<TimeNs> period = period_of(onsets);
    if (!period || (frames.period && std::abs(*period - *frames.period) > kTolerance)) return std::nullopt;
    if (!frames.period) frames.period = period;
  }
  if (!starts.empty()) frames.start = starts.front();
  if (!ends.empty()) frames.end = ends.front();
  if (!frames.start || !frames.end) return frames;
  if (frames.period) {
    while (*frames.end <= *frames.start) *frames.end += *frames.period;
    while (*frames.end - *frames.period > *frames.start) *frames.end -= *frames.period;
  }
  // Without a period, the end of one frame may come before the start of the next.
  if (*frames.end - *frames.start < kShortestExposure) return std::nullopt;
  return frames;
}

BurstEvents count_burst_events(EventSpan events, const FrameTimes& frames) {
  constexpr TimeNs kEarly = 50 * kNsPerUs, kLate = 250 * kNsPerUs;  // bursts are within these times of an onset
  if (events.empty()) return {};
  BurstEvents sum;
  for (const bool on : {false, true}) {
    const std::optional<TimeNs> time = on ? frames.end : frames.start;
    if (!time) continue;
    const Times times(events, on);
    for (const TimeNs t : repetitions(*time, frames.period, events)) {
      const BurstEvents burst = beyond_expected(times, t - kEarly, kEarly + kLate);
      sum.events += burst.events;
      sum.deviation = std::hypot(sum.deviation, burst.deviation);
    }
  }
  return sum;
}

}  // namespace esim::inline stats

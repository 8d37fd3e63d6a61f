// Ten million random events of 1280 x 720 pixels in 0.5 s, in order of time, through each filter with its default
// options and through all of them. "events/s" counts the events before the filter, by processor time; "kept" is the
// fraction that passes. Random pixels are the worst case for filters with a state per pixel.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>

#include "esim/filters/filter_chain.h"

namespace esim {
namespace {

constexpr int kWidth = 1280, kHeight = 720;
constexpr std::size_t kEvents = 10'000'000;
constexpr std::size_t kPortion = 1 << 16;
constexpr TimeNs kDuration = kNsPerSecond / 2;

const std::vector<Event>& random_events() {
  static const std::vector<Event> events = [] {
    std::mt19937_64 random(1);
    std::vector<Event> made(kEvents);
    for (Event& event : made) {
      event = {static_cast<TimeNs>(random() % kDuration), static_cast<std::uint16_t>(random() % kWidth),
               static_cast<std::uint16_t>(random() % kHeight), static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)};
    }
    std::sort(made.begin(), made.end());
    return made;
  }();
  return events;
}

void run(benchmark::State& state, const FilterOptions& options) {
  const EventSpan events = random_events();
  std::size_t kept = 0;
  for (auto _ : state) {
    FilterChain chain(options, kWidth, kHeight);
    std::vector<Event> out;
    kept = 0;
    for (std::size_t done = 0; done < events.size(); done += kPortion) {
      out.clear();
      chain.process(events.subspan(done, std::min(kPortion, events.size() - done)), out);
      kept += out.size();
    }
  }
  state.counters["events/s"] = benchmark::Counter(
      static_cast<double>(kEvents) * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["kept"] = static_cast<double>(kept) / kEvents;
}

void add(const char* name, const FilterOptions& options) {
  benchmark::RegisterBenchmark(name, run, options)->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace esim

int main(int argc, char** argv) {
  using namespace esim;
  const RegionFilterOptions region{false, {{320, 180, 640, 360}}, {}};
  const ActivityFilterOptions activity{.lower_start = 1e6};
  add("filter/none", {});
  add("filter/region", {.region = region});
  add("filter/activity", {.activity = activity});
  add("filter/anti_flicker", {.anti_flicker = AntiFlickerOptions{}});
  add("filter/trail", {.trail = TrailFilterOptions{}});
  add("filter/rate_controller", {.rate_controller = RateControllerOptions{.events_per_period = 2000}});
  add("filter/all",
      {region, activity, AntiFlickerOptions{}, TrailFilterOptions{}, RateControllerOptions{.events_per_period = 500}});
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}

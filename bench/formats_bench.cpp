// Ten million random events of 640 x 480 pixels (or the largest sensor that the format holds), in order of time,
// written and read in every format that holds events, to a file in memory. "events/s" is wall
// time; "bytes" are the bytes of the file per event. Names are read/FORMAT or write/FORMAT. Formats with several
// compressions are measured with each of them.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "esim/formats/formats.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr std::size_t kEvents = 10'000'000;
constexpr std::size_t kPortion = 1 << 16;
constexpr TimeNs kDuration = 5 * kNsPerSecond;

SensorSize sensor_of(const Format& format) {
  return {std::min(format.max_width, 640), std::min(format.max_height, 480)};
}

/// Evenly spread over time and sensor.
const std::vector<Event>& random_events(SensorSize sensor) {
  static std::vector<Event> events;
  static SensorSize made_for;
  if (!events.empty() && made_for.width == sensor.width && made_for.height == sensor.height) return events;
  made_for = sensor;
  std::mt19937_64 random(1);
  events.resize(kEvents);
  for (Event& event : events) {
    event.t = static_cast<TimeNs>(random() % kDuration);
    event.x = static_cast<std::uint16_t>(random() % static_cast<unsigned>(sensor.width));
    event.y = static_cast<std::uint16_t>(random() % static_cast<unsigned>(sensor.height));
    event.polarity = random() % 2 == 0 ? 1 : -1;
  }
  std::sort(events.begin(), events.end());
  return events;
}

void write_file(const Format& format, const WriteOptions& options, const std::filesystem::path& path) {
  const SensorSize sensor = sensor_of(format);
  const EventSpan events = random_events(sensor);
  RecordingInfo info;
  info.cameras.emplace_back().name = "cam0";
  info.cameras[0].model.width = sensor.width, info.cameras[0].model.height = sensor.height;
  info.end = kDuration;
  const auto sink = format.create(path, options);
  sink->begin(info);
  for (std::size_t done = 0; done < events.size(); done += kPortion) {
    sink->write(EventsRecord{0, events.subspan(done, std::min(kPortion, events.size() - done))});
  }
  sink->end(true);
}

std::size_t read_file(const Format& format, const std::filesystem::path& path) {
  const auto source = format.open(path, {});
  std::size_t count = 0;
  while (const Record* record = source->next()) count += std::get<EventsRecord>(*record).events.size();
  return count;
}

void report(benchmark::State& state, const std::filesystem::path& path) {
  state.counters["events/s"] = benchmark::Counter(
      static_cast<double>(kEvents) * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(path)) / kEvents;
}

void write(benchmark::State& state, const Format& format, WriteOptions options, const std::filesystem::path& path) {
  random_events(sensor_of(format));
  for (auto _ : state) write_file(format, options, path);
  report(state, path);
}

void read(benchmark::State& state, const Format& format, WriteOptions options, const std::filesystem::path& path) {
  write_file(format, options, path);
  for (auto _ : state) {
    if (read_file(format, path) != kEvents) state.SkipWithError("events are missing");
  }
  report(state, path);
}

void add(const std::string& name, const Format& format, const WriteOptions& options,
         const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / ("events" + format.extension());
  const auto add_one = [&](const std::string& what, auto function) {
    benchmark::RegisterBenchmark((what + name).c_str(), function, format, options, path)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime()
        ->Iterations(2);
  };
  add_one("write/", &write);
  add_one("read/", &read);
}

bool is_tried(const Format& format) {
  return format.can_hold(Content::events) && format.create && format.open && !format.folder &&
         format.max_time >= kDuration;
}

/// In memory, where there is such a folder.
void use_memory() {
  std::error_code error;
  if (std::filesystem::is_directory("/dev/shm", error)) setenv("TMPDIR", "/dev/shm", 0);
}

}  // namespace
}  // namespace esim

int main(int argc, char** argv) {
  using esim::Compression;
  esim::use_memory();
  const esim::test::TemporaryDirectory folder;
  for (const esim::Format& format : esim::all_formats()) {
    if (!esim::is_tried(format)) continue;
    if (format.name == "dsec" || format.name == "mcap-packets")
      esim::add(format.name + ", uncompressed", format, {.compression = Compression::none}, folder.path());
    esim::add(format.name, format, {}, folder.path());
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}

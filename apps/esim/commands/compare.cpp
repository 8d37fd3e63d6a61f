#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "commands.h"
#include "esim/compare/comparison_figure.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_file.h"
#include "esim/preview/pictures.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPortion = 1 << 20;
constexpr double kEqualDurations = 0.01;  // durations that differ by less are not cut

struct CompareArguments {
  std::vector<std::string> files;
  std::optional<SensorSize> sensor;
  std::string out;
  double shift_s = 0;
  bool same_scene = false, json = false, force = false;
};

/// The statistics of the events until `duration_s` after the first one.
SensorStatistics statistics_of(const std::string& path, const CompareArguments& arguments, double duration_s) {
  EventsFile file(path, {arguments.sensor, {}});
  SensorStatisticsCounter counter(file.sensor());
  std::vector<Event> events;
  std::optional<TimeNs> end;
  while (file.read(events, kPortion)) {
    if (!end && !events.empty()) {
      end = std::numeric_limits<TimeNs>::max();
      if (duration_s < to_seconds(*end - events.front().t)) end = events.front().t + to_ns(duration_s);
    }
    const EventSpan wanted = end ? events_within(events, {events.front().t, *end}) : EventSpan{};
    counter.add(wanted);
    if (wanted.size() < events.size()) break;
  }
  return std::move(counter).finish();
}

std::vector<Event> read_all(const std::string& path, const CompareArguments& arguments, double shift_s) {
  EventsFile file(path, {arguments.sensor, {}});
  std::vector<Event> all, events;
  const TimeNs shift = to_ns(shift_s);
  while (file.read(events, kPortion)) {
    for (Event& event : events) event.t += shift;
    all.insert(all.end(), events.begin(), events.end());
  }
  return all;
}

RecordingComparison compare_files(const CompareArguments& arguments) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  RecordingComparison c;
  c.first_name = arguments.files[0], c.second_name = arguments.files[1];
  c.first = statistics_of(c.first_name, arguments, kAll);
  c.second = statistics_of(c.second_name, arguments, kAll);
  c.compared_s = std::min(c.first.duration_s, c.second.duration_s);
  if (const double limit_s = (1 + kEqualDurations) * c.compared_s; c.compared_s > 0) {
    if (c.first.duration_s > limit_s) c.first = statistics_of(c.first_name, arguments, c.compared_s);
    if (c.second.duration_s > limit_s) c.second = statistics_of(c.second_name, arguments, c.compared_s);
  }
  c.statistics = compare_sensors(c.first, c.second);
  return c;
}

int run(const CompareArguments& arguments) {
  if (!arguments.out.empty() && fs::exists(arguments.out) && !arguments.force)
    throw UserError(arguments.out + " exists; choose another --out, or replace it with --force");
  if (arguments.shift_s != 0 && !arguments.same_scene)
    throw UserError("--shift has no effect without --same-scene; add it, or remove --shift");
  RecordingComparison comparison = compare_files(arguments);
  const auto [width, height] = comparison.first.sensor;
  if (width != comparison.second.sensor.width || height != comparison.second.sensor.height) {
    const std::string sizes = fmt::format("{} x {} and {} x {} px", width, height, comparison.second.sensor.width,
                                          comparison.second.sensor.height);
    if (arguments.same_scene) {
      throw UserError("--same-scene needs recordings of one sensor, not of " + sizes +
                      "; if a file does not contain the size, give it with --width and --height");
    }
    tell(stderr, "warning: the sensors have {}\n", sizes);
  }
  std::vector<Event> first, second;
  TimeNs shown = 0;
  if (arguments.same_scene) {
    first = read_all(arguments.files[0], arguments, 0);
    second = read_all(arguments.files[1], arguments, arguments.shift_s);
    comparison.scene = compare_scenes(first, second, comparison.first.sensor);
    shown = (comparison.scene->span.start + comparison.scene->span.end) / 2;
  }
  if (!arguments.out.empty())
    write_file_atomically(arguments.out, encode_png(draw_comparison(comparison, first, second, shown)));
  fmt::print("{}", arguments.json ? to_json(comparison) : describe(comparison));
  if (!arguments.json)
    tell(stderr, "{}\n", arguments.out.empty() ? "for a figure, add --out FILE.png" : "figure: " + arguments.out);
  return kOk;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command = app.add_subcommand("compare", "Tell how alike the events of two sensors are, and what differs");
  command->add_option("file", arguments->files, "Two recordings or files of events, in any format of esim convert")
      ->required()
      ->expected(2)
      ->type_name("A B");
  command->add_flag("--same-scene", arguments->same_scene,
                    "Both saw the same scene and motion: also match their events, and compare time surfaces");
  command->add_option("--shift", arguments->shift_s, "Seconds to add to the times of B, with --same-scene")
      ->type_name("S")
      ->check(CLI::Range(-1e9, 1e9));
  add_sensor_options(*command, arguments->sensor);
  command->add_option("-o,--out", arguments->out, "Write a figure to this file")->type_name("FILE.png");
  command->add_flag("--json", arguments->json, "Print JSON, in SI units");
  command->add_flag("--force", arguments->force, "Replace an existing figure");
  command->footer(
      "Examples:\n"
      "  esim compare real.raw out/simulated                     which statistics tell them apart\n"
      "  esim compare real.raw out/simulated --out like.png      with a figure\n"
      "  esim compare out/a out/b --same-scene                   events that are missing, spurious or late\n"
      "  esim compare real.bag out/b --json > comparison.json");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

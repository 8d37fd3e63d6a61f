#include <fmt/format.h>

#include <filesystem>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"
#include "esim/stats/figure.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPortion = 1 << 20;

struct StatsArguments {
  std::vector<std::string> files;
  std::optional<double> fps, frame_period_s;
  std::optional<SensorSize> sensor;
  double hot_sigmas = 5;
  std::string out;
  bool plot = false, json = false, force = false;
};

NamedStatistics compute(const std::string& path, const StatsArguments& arguments) {
  EventsFile file(path, {arguments.sensor, {}});
  EventStatistics statistics(file.sensor());
  std::vector<Event> events;
  while (file.read(events, kPortion)) statistics.add(events);

  StatisticsOptions options;
  options.hot_pixel_sigmas = arguments.hot_sigmas;
  options.frame_rate_hz = arguments.fps;
  if (arguments.frame_period_s) options.frame_rate_hz = 1 / *arguments.frame_period_s;
  return {file.path().string(), std::move(statistics).finish(options)};
}

// The path of the figure, if requested: FILE.stats.png next to FILE.h5, FOLDER.stats.png next to a folder.
std::optional<fs::path> figure_path(const StatsArguments& arguments) {
  if (!arguments.out.empty()) return arguments.out;
  if (!arguments.plot) return std::nullopt;
  const fs::path file = fs::path(arguments.files.front() + "/").parent_path();  // without a slash at its end
  if (fs::is_directory(file)) return fs::path(file) += ".stats.png";
  return fs::path(file).replace_extension(".stats.png");
}

int run(const StatsArguments& arguments) {
  const std::optional<fs::path> figure = figure_path(arguments);
  if (figure && arguments.files.size() > 1)
    throw UserError("a figure shows one file only; give one file, or remove --plot and --out");
  if (figure && fs::exists(*figure) && !arguments.force) {
    throw UserError(figure->string() + " exists; choose another --out, or replace it with --force");
  }
  std::vector<NamedStatistics> all;
  for (const std::string& file : arguments.files) all.push_back(compute(file, arguments));
  if (figure) write_file_atomically(*figure, encode_png(draw_figure(all.front())));
  if (!arguments.json) {
    fmt::print("{}", describe(all));
    fmt::print(stderr, "{}\n", figure ? "figure: " + figure->string() : "for a figure, add --plot or --out FILE.png");
  } else if (all.size() == 1) {
    fmt::print("{}", to_json(all.front()));
  } else {
    fmt::print("[{},{}]\n", to_json(all.front()), to_json(all.back()));
  }
  return kOk;
}

}  // namespace

void add_stats(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<StatsArguments>();
  CLI::App* command =
      app.add_subcommand("stats", "Print and draw statistics of events; compare two files side by side");
  command
      ->add_option("file", arguments->files, "events.h5 (also DSEC's), lines of text `t x y p`, or a recording folder")
      ->required()
      ->expected(1, 2)
      ->type_name("FILE");
  auto* fps = command->add_option("--fps", arguments->fps, "Frame rate to look for in the time stamps, Hz")
                  ->type_name("F")
                  ->check(CLI::Range(1e-3, 1e6));
  command->add_option("--frame-period", arguments->frame_period_s, "Time between frames, s, instead of --fps")
      ->type_name("S")
      ->check(CLI::Range(1e-6, 1e3))
      ->excludes(fps);
  add_sensor_options(*command, arguments->sensor);
  command
      ->add_option("--hot-sigmas", arguments->hot_sigmas,
                   "Minimum rate of a hot pixel above the median, in robust standard deviations")
      ->type_name("K")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON, in SI units");
  command->add_option("-o,--out", arguments->out, "Write a figure to this file")->type_name("FILE.png");
  command->add_flag("--plot", arguments->plot, "Write a figure to NAME.stats.png next to FILE");
  command->add_flag("--force", arguments->force, "Replace an existing figure");
  command->footer(
      "Examples:\n"
      "  esim stats out/room --plot                              then look at out/room.stats.png\n"
      "  esim stats events.txt --fps 30                          check whether time stamps cluster at the frames\n"
      "  esim stats simulated/events.h5 real/events.h5           side by side\n"
      "  esim stats out/rig/left --json > left.json");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

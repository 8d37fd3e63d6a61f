#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/fit/sensor_fit.h"
#include "esim/preview/pictures.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFigure = "distributions.png";

struct FitArguments {
  std::vector<std::string> moving, constant, flicker, other;
  std::optional<SensorSize> sensor;
  FitOptions options;
  std::string out;
  bool json = false, force = false, quiet = false;
};

/// The last part of FILE:PART, which it removes; nothing without a colon.
std::optional<std::string> take_last(std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || fs::exists(text)) return std::nullopt;
  const std::string part = text.substr(colon + 1);
  text.resize(colon);
  return part;
}

/// A number; NaN for "?". fit_sensor() checks its range.
double number_of(const std::string& text, const std::string& argument, const char* what) {
  if (text == "?") return std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value))
    throw UserError(fmt::format("{}: '{}' must be {}, a number; write ? if it is unknown", argument, text, what));
  return value;
}

/// RECORDING or RECORDING:LUX
LitRecording constant_of(const std::string& text) {
  std::string path = text;
  const std::optional<std::string> lux = take_last(path);
  if (!lux) return {text, {}};
  return {path, {number_of(*lux, "--static " + text, "the illuminance of the sensor in lux")}};
}

/// RECORDING:HZ:MODULATION:LUX
LitRecording flicker_of(const std::string& text) {
  const std::string argument = "--flicker " + text;
  std::string path = text;
  const auto lux = take_last(path), modulation = take_last(path), hz = take_last(path);
  if (!lux || !modulation || !hz || path.empty()) {
    throw UserError(argument +
                    ": must be RECORDING:HZ:MODULATION:LUX, such as lamp.raw:100:0.5:200, with ? for what is "
                    "unknown");
  }
  if (*hz == "?") throw UserError(argument + ": the frequency of the lamp must be known; state it instead of ?");
  return {path,
          {number_of(*lux, argument, "the mean illuminance of the sensor in lux"),
           number_of(*hz, argument, "the frequency of the lamp in Hz"),
           number_of(*modulation, argument, "the modulation, (max - min) / (max + min)")}};
}

int run(FitArguments arguments) {
  catch_interrupts();
  const fs::path out = arguments.out;
  if (!arguments.out.empty() && fs::exists(out / "sensor.yaml") && !arguments.force)
    throw UserError((out / "sensor.yaml").string() + " exists; choose another --out, or replace it with --force");
  FitInput input;
  input.moving.assign(arguments.moving.begin(), arguments.moving.end());
  for (const std::string& text : arguments.constant) input.constant.push_back(constant_of(text));
  for (const std::string& text : arguments.flicker) input.flicker.push_back(flicker_of(text));
  input.other.assign(arguments.other.begin(), arguments.other.end());
  input.sensor = arguments.sensor;
  ProgressBar bar(!arguments.quiet);
  arguments.options.progress = [&](double part, const std::string& what) {
    bar.show(part, [&] { return what; });
    return !interrupted();
  };
  const std::optional<SensorFit> fit = fit_sensor(input, arguments.options);
  bar.clear();
  if (!fit) return kInterrupted;
  if (!arguments.out.empty()) {
    fs::create_directories(out);
    const bool drawn = !fit->distributions.empty();
    if (drawn) write_file_atomically(out / kFigure, encode_png(draw_fit(*fit)));
    write_text(out / "report.md", to_markdown(*fit, drawn ? kFigure : ""));
    write_text(out / "sensor.yaml", to_yaml(*fit));
  }
  tell(stdout, "{}", arguments.json ? to_json(*fit) : describe(*fit));
  if (!arguments.json) {
    tell(stderr, "{}\n",
         arguments.out.empty()
             ? "for the sensor as a file, and a report, add --out FOLDER"
             : "sensor: " + (out / "sensor.yaml").string() + ", report: " + (out / "report.md").string());
  }
  return kOk;
}

}  // namespace

void add_fit(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<FitArguments>();
  CLI::App* command =
      app.add_subcommand("fit", "Find the parameters of a sensor from its recordings, with confidence intervals");
  command->add_option("recording", arguments->other, "Recordings of any scene: refractory period and readout")
      ->type_name("RECORDING");
  const auto add = [&](const char* name, std::vector<std::string>& paths, const char* help) {
    command->add_option(name, paths, help)->type_name("RECORDING")->expected(1)->take_all();
  };
  add("--moving", arguments->moving, "A moving scene, with events and images of the same view: thresholds");
  add("--static", arguments->constant,
      "A scene without motion in constant light: leak, hot pixels, noise. As RECORDING:LUX, with the illuminance of "
      "the sensor (0: lens cap), also charge of the photodiode and dark current, such as cap.raw:0");
  add("--flicker", arguments->flicker,
      "A lamp that fills the view and flickers as a sinusoid, as RECORDING:HZ:MODULATION:LUX, such as "
      "lamp.raw:50:0.6:300: thresholds, photocurrent, source follower, latency. At least two frequencies, and two "
      "illuminances");
  command->add_option("--base", arguments->options.base, "Preset for everything that the recordings do not determine")
      ->type_name("PRESET")
      ->capture_default_str();
  command->add_flag("--find-offset", arguments->options.find_offset,
                    "Also find the offset o of brightness ln(E + o); needs light and dark surfaces");
  add_sensor_options(*command, arguments->sensor);
  command->add_option("-o,--out", arguments->out, "Write sensor.yaml, report.md and a figure to this folder")
      ->type_name("FOLDER");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->add_flag("--force", arguments->force, "Replace an existing sensor.yaml");
  command->add_flag("-q,--quiet", arguments->quiet, "No progress bar");
  command->footer(
      "Examples:\n"
      "  esim fit --static wall.raw --moving desk.bag --base davis346 --out my_davis\n"
      "  esim fit --flicker a.raw:25:0.6:10 --flicker b.raw:100:0.6:10 --flicker c.raw:50:0.6:300 \\\n"
      "           --flicker d.raw:200:0.6:300 --static cap.raw:0 --static wall.raw:5 --base davis346\n"
      "  esim fit --moving desk.bag --find-offset --out my_davis --force\n"
      "  esim fit --static events.txt --width 346 --height 260 --json --quiet\n"
      "  esim fit street.raw                                     refractory period and readout, from events alone\n"
      "  esim evaluate realism recordings --sensor my_davis/sensor.yaml");
  command->callback([arguments, &exit_code] { exit_code = run(std::move(*arguments)); });
}

}  // namespace esim::app

#include <fmt/format.h>

#include <filesystem>

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
  std::vector<std::string> moving, constant, other;
  std::optional<SensorSize> sensor;
  FitOptions options;
  std::string out;
  bool json = false, force = false, quiet = false;
};

int run(FitArguments arguments) {
  catch_interrupts();
  const fs::path out = arguments.out;
  if (!arguments.out.empty() && fs::exists(out / "sensor.yaml") && !arguments.force)
    throw UserError((out / "sensor.yaml").string() + " exists; choose another --out, or replace it with --force");
  FitInput input;
  input.moving.assign(arguments.moving.begin(), arguments.moving.end());
  input.constant.assign(arguments.constant.begin(), arguments.constant.end());
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
  add("--static", arguments->constant, "A scene without motion in constant light: leak, hot pixels, noise");
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
      "  esim fit street.raw                                     refractory period and readout, from events alone\n"
      "  esim evaluate realism recordings --sensor my_davis/sensor.yaml");
  command->callback([arguments, &exit_code] { exit_code = run(std::move(*arguments)); });
}

}  // namespace esim::app

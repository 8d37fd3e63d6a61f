#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "commands.h"
#include "esim/characterise/characterisation_figure.h"
#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"
#include "esim/scenario/conversion.h"
#include "esim/scenario/read.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

struct CharacteriseArguments {
  std::vector<std::string> sensors, overrides;
  CharacterisationOptions options;
  int pixels = 24;
  std::string out;
  bool json = false, force = false, quiet = false;
};

/// A preset by its name, or the event camera of the first camera of a scenario.
EventCameraOptions sensor_of(const std::string& sensor, const std::vector<std::string>& overrides) {
  std::vector<std::string> options;
  if (!fs::exists(sensor)) {
    options.push_back("preset=" + sensor);
    options.insert(options.end(), overrides.begin(), overrides.end());
    return read_event_camera(options);
  }
  for (const std::string& override : overrides) options.push_back("event_camera." + override);
  const Scenario scenario = read_scenario(sensor, options);
  return event_camera_of(scenario, scenario.cameras.front());
}

int run(CharacteriseArguments arguments) {
  if (!arguments.out.empty() && fs::exists(arguments.out) && !arguments.force)
    throw UserError(arguments.out + " exists; choose another --out, or replace it with --force");
  std::sort(arguments.options.lux.begin(), arguments.options.lux.end());
  arguments.options.width = arguments.options.height = arguments.pixels;
  std::vector<EventCameraOptions> sensors;
  for (const std::string& sensor : arguments.sensors) sensors.push_back(sensor_of(sensor, arguments.overrides));
  ProgressBar bar(!arguments.quiet);
  std::vector<Characterisation> results;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const auto show = [&](double part) {
      bar.show((static_cast<double>(i) + part) / static_cast<double>(sensors.size()),
               [&] { return arguments.sensors[i]; });
    };
    show(0);
    results.push_back(characterise_sensor(arguments.sensors[i], sensors[i], arguments.options, show));
  }
  bar.clear();
  if (!arguments.out.empty()) write_file_atomically(arguments.out, encode_png(draw_characterisation(results)));
  fmt::print("{}", arguments.json ? to_json(results) : describe(results));
  if (!arguments.json)
    tell(stderr, "{}\n", arguments.out.empty() ? "for a figure, add --out FILE.png" : "figure: " + arguments.out);
  return kOk;
}

}  // namespace

void add_characterise(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CharacteriseArguments>();
  CharacterisationOptions& options = arguments->options;
  options.threads = 0;
  CLI::App* command = app.add_subcommand(
      "characterise", "Measure a simulated sensor as makers do: S-curves, latency, bandwidth, noise by illuminance");
  command
      ->add_option("sensor", arguments->sensors,
                   "One or two sensors: the name of a preset, or a scenario's event camera")
      ->required()
      ->expected(1, 2)
      ->type_name("PRESET|SCENARIO.yaml");
  command
      ->add_option("--set", arguments->overrides,
                   "Change one option of the sensors, for example --set refractory_period_us=100")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->take_all();
  command
      ->add_option("--lux", options.lux,
                   "Illuminances of the sensor, separated by commas; relative irradiances for a sensor without circuit")
      ->type_name("LUX,...")
      ->delimiter(',')
      ->check(CLI::Range(1e-4, 1e5))
      ->capture_default_str();
  command->add_option("--pixels", arguments->pixels, "Rows and columns of pixels on the bench")
      ->type_name("N")
      ->check(CLI::Range(2, 256))
      ->capture_default_str();
  command->add_option("--repeats", options.repeats, "Trials of each change of the light")
      ->type_name("N")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  command->add_option("--background-s", options.noise_s, "Seconds of constant light for the background rate")
      ->type_name("S")
      ->check(CLI::Range(0.1, 1e4))
      ->capture_default_str();
  command->add_option("--width", options.sensor_width, "Width of the sensor for the peak rate, px")
      ->type_name("PX")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command->add_option("--height", options.sensor_height, "Its height, px")
      ->type_name("PX")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command->add_option("--seed", options.seed, "Seed of all random numbers")->type_name("N")->capture_default_str();
  command->add_option("--threads", options.threads, "Number of threads; 0 uses every processor")
      ->type_name("N")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command->add_option("-o,--out", arguments->out, "Write a figure to this file")->type_name("FILE.png");
  command->add_flag("--json", arguments->json, "Print JSON, in SI units, with the complete S-curves");
  command->add_flag("--force", arguments->force, "Replace an existing figure");
  command->add_flag("-q,--quiet", arguments->quiet, "No progress bar");
  command->footer(
      "Examples:\n"
      "  esim characterise davis346                              thresholds, latency, bandwidth and noise from 0.1 to "
      "1000 lux\n"
      "  esim characterise davis346 imx636 --out sensors.png     two sensors side by side, with a figure\n"
      "  esim characterise scenes/room.yaml --lux 5,500          the event camera of a scenario\n"
      "  esim characterise dvs128 --set circuit.photodiode_charge_e=800 --json > dvs128.json");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

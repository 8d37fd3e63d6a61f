#include <fmt/format.h>

#include <filesystem>
#include <regex>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/evaluate/realism/realism.h"
#include "esim/scenario/conversion.h"
#include "progress_bar.h"
#include "sensor_argument.h"
#include "support.h"

namespace esim::app {
namespace {

constexpr double kIdealThreshold = 0.25;

struct RealismArguments {
  std::string folder;
  std::vector<std::string> sensors, programs;
  std::string fit_to, save;
  RealismOptions options;
  bool json = false, quiet = false;
};

std::vector<SensorModel> models_of(const RealismArguments& arguments) {
  std::vector<SensorModel> models;
  for (const std::string& sensor : arguments.sensors) models.push_back({sensor, sensor_of(sensor, {}), {}});
  if (arguments.sensors.empty()) {
    EventCameraOptions ideal;
    ideal.contrast_threshold = kIdealThreshold;
    models.push_back({"ideal", ideal, {}});
    for (const std::string& name : SensorPreset::names()) {
      if (name.find('@') == std::string::npos) models.push_back({name, preset_options(name), {}});
    }
  }
  for (const std::string& program : arguments.programs) {
    const std::size_t equals = program.find('=');
    if (equals == 0 || equals == std::string::npos || program.find("{events}") == std::string::npos)
      throw UserError("--program " + program + ": must be NAME=COMMAND, with {frames} and {events} in the command");
    models.push_back({program.substr(0, equals), {}, program.substr(equals + 1)});
  }
  return models;
}

/// CLIP:FROM:TO
ClipPart clip_part_of(const std::string& text) {
  const std::size_t second = text.rfind(':'), first = second == 0 ? second : text.rfind(':', second - 1);
  ClipPart part;
  if (second == std::string::npos || first == std::string::npos || first == 0 ||
      !CLI::detail::lexical_cast(text.substr(first + 1, second - first - 1), part.from) ||
      !CLI::detail::lexical_cast(text.substr(second + 1), part.to) || !(part.from < part.to))
    throw UserError("--fit-to " + text +
                    ": must be CLIP:FROM:TO, with fractions of the clip's duration, such as 0:0.5");
  part.clip = text.substr(0, first);
  return part;
}

int run(RealismArguments arguments) {
  catch_interrupts();
  if (!arguments.save.empty() && arguments.fit_to.empty())
    throw UserError("--save-fitted " + arguments.save + ": nothing is fitted without --fit-to");
  if (!arguments.fit_to.empty()) arguments.options.fit_to = clip_part_of(arguments.fit_to);
  ProgressBar bar(!arguments.quiet);
  const RealismEvaluation evaluation = evaluate_realism(arguments.folder, models_of(arguments), arguments.options,
                                                        [&](double fraction, const std::string& what) {
                                                          bar.show(fraction, [&] { return what; });
                                                          return !interrupted();
                                                        });
  bar.clear();
  if (!arguments.save.empty()) {
    std::filesystem::create_directories(arguments.save);
    for (const FittedModel& fitted : evaluation.fitted) {
      const std::filesystem::path name = std::filesystem::path(fitted.model).stem();
      write_text(std::filesystem::path(arguments.save) / (name.string() + "_fitted.yaml"),
                 "event_camera:\n  " +
                     std::regex_replace(write_event_camera(fitted.fit.options), std::regex("\n(?=.)"), "\n  "));
    }
  }
  tell(stdout, "{}", arguments.json ? to_json(evaluation) : describe(evaluation));
  return interrupted() ? kInterrupted : kOk;
}

}  // namespace

void add_realism(CLI::App& evaluate, int& exit_code) {
  auto arguments = std::make_shared<RealismArguments>();
  arguments->options.threads = 0;
  CLI::App* command = evaluate.add_subcommand(
      "realism", "Compare simulated sensors with recordings of real ones, statistic by statistic");
  command
      ->add_option("folder", arguments->folder,
                   "Recordings: folders with events.txt, flow.npy and a frame, and files noise_pos_*lux.npy")
      ->required()
      ->type_name("FOLDER");
  command
      ->add_option(
          "--sensor", arguments->sensors,
          "A preset, or a YAML file with an event camera; may be given several times (default: all presets, and "
          "the ideal pixel)")
      ->type_name("PRESET|FILE.yaml")
      ->expected(1)
      ->take_all();
  command
      ->add_option("--program", arguments->programs,
                   "Another simulator: NAME=COMMAND, run for each clip. {frames} in it becomes a folder with 16-bit "
                   "frames and images.csv (time in ns, file), {events} the file of events to write")
      ->type_name("NAME=COMMAND")
      ->expected(1)
      ->take_all();
  command
      ->add_option(
          "--fit-to", arguments->fit_to,
          "Also fit each sensor to this part of a clip, in fractions of its duration: thresholds, refractory period, "
          "readout, leak and frame coupling. Of that clip, only the rest is then compared")
      ->type_name("CLIP:FROM:TO");
  command
      ->add_option("--save-fitted", arguments->save, "Write the fitted sensors to this folder, as SENSOR_fitted.yaml")
      ->type_name("FOLDER");
  command->add_option("--frame-step", arguments->options.frame_step_s, "Time between the frames of the clips, s")
      ->type_name("S")
      ->check(CLI::Range(1e-6, 0.1))
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Seed of all random numbers")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--threads", arguments->options.threads, "Number of threads; 0 uses every processor")
      ->type_name("N")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON, in SI units");
  command->add_flag("-q,--quiet", arguments->quiet, "No progress bar");
  command->footer(
      "Examples:\n"
      "  esim evaluate realism recordings\n"
      "  esim evaluate realism recordings --sensor davis240c --sensor my_sensor.yaml --json > realism.json\n"
      "  esim evaluate realism recordings --sensor davis346 --fit-to poster:0:0.5\n"
      "  esim evaluate realism recordings --program 'v2e=python3 run_v2e.py {frames} {events}'");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

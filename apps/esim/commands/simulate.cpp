#include <fmt/format.h>

#include <filesystem>

#include "commands.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/recording/recording_directory.h"
#include "esim/scenario/read.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

struct SimulateArguments : RunOptions {
  std::string scenario;
  std::string out;
  std::optional<std::uint64_t> seed;
  std::string keep_samples{};
  std::string resume{};
  bool no_cache = false;
  ImageCacheOptions images{};
};

void print_summary(const Summary& summary, const std::filesystem::path& out, bool previews) {
  std::int64_t events = 0, samples = 0;
  for (const CameraSummary& camera : summary.cameras) {
    events += camera.events();
    samples += camera.sampling.samples;
  }
  const double simulated_s = to_seconds(summary.end - summary.start);
  tell(stderr, "{}: {:.3f} s simulated in {:.1f} s ({:.2f}x real time), {} samples, {} events\n",
       summary.complete ? "done" : "interrupted", simulated_s, summary.wall_seconds, simulated_s / summary.wall_seconds,
       samples, events);
  if (const auto& images = summary.engine_images)
    tell(stderr, "images:    {} rendered, {} from the cache {}\n", images->rendered, images->from_cache, images->cache);
  tell(stderr, "{}recording: {}\n", describe(filtered_cameras(summary)), out.string());
  for (const CameraSummary& camera : summary.cameras) {
    if (previews) tell(stderr, "look at:   {}\n", (out / camera.name / "preview.png").string());
  }
}

int run(const SimulateArguments& arguments) {
  std::vector<std::string> overrides = arguments.overrides;
  if (!arguments.keep_samples.empty()) overrides.push_back("output.samples=" + arguments.keep_samples);
  if (arguments.seed) overrides.push_back(fmt::format("seed={}", *arguments.seed));
  const bool resume = !arguments.resume.empty();
  const std::filesystem::path file = !arguments.scenario.empty() ? std::filesystem::path(arguments.scenario)
                                     : resume
                                         ? RecordingDirectory::resumable(arguments.resume) / "scenario.yaml"
                                         : throw UserError("name a scenario to simulate, or a recording to --resume");
  const Scenario scenario = read_scenario(file, overrides);
  const std::filesystem::path out = resume                  ? std::filesystem::path(arguments.resume)
                                    : arguments.out.empty() ? std::filesystem::path("out") / file.stem()
                                                            : std::filesystem::path(arguments.out);

  ImageCacheOptions images = arguments.images;
  images.use = !arguments.no_cache;

  catch_interrupts();
  ProgressBar bar(!arguments.quiet);
  const auto made = make_recording(scenario,
                                   {.out = out,
                                    .replace = arguments.force,
                                    .resume = resume,
                                    .threads = arguments.threads,
                                    .repetition = {shell_command(own_command_line())},
                                    .images = images},
                                   printing(arguments.quiet), [&](const Progress& progress) {
                                     bar.show(progress);
                                     return !interrupted();
                                   });
  bar.clear();
  if (!made) return kInterrupted;  // while loading: nothing was worth keeping
  const Summary& summary = *made;
  for (const std::string& loss : losses(scenario, summary)) tell(stderr, "warning: {}\n", loss);
  if (!arguments.quiet) {
    print_summary(summary, out, scenario.output.preview && scenario.truth.rate_hz > 0);
    for (const std::string& hint : hints(scenario, summary)) {
      tell(stderr, "hint:      {}: esim simulate {} --set 'sampling={{type: flow}}'\n", hint, arguments.scenario);
    }
  }
  if (!summary.complete && can_be_resumed(out)) tell(stderr, "continue:  esim simulate --resume {}\n", out.string());
  if (!summary.problem.empty()) {
    throw UserError(fmt::format("{}; the {:.3f} s before this error are kept in {}, marked incomplete", summary.problem,
                                to_seconds(summary.end - summary.start), out.string()));
  }
  return summary.complete ? kOk : kInterrupted;
}

}  // namespace

void add_simulate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "Simulate a scenario and write a recording");
  command->add_option("scenario", arguments->scenario, "Scenario file (YAML); with --resume, it is not needed")
      ->type_name("SCENARIO.yaml");
  CLI::Option* const out =
      command->add_option("-o,--out", arguments->out, "Folder to write (default: out/NAME of the scenario)")
          ->type_name("DIR");
  command
      ->add_option("--resume", arguments->resume,
                   "Continue the simulation that was to become this folder, and that was killed, interrupted, or lost "
                   "its engine, from its last checkpoint")
      ->type_name("DIR")
      ->excludes(out);
  add_run_options(*command, *arguments, "Change one option, for example --set event_camera.contrast_threshold=0.2");
  command->add_option("--seed", arguments->seed, "Seed of all random numbers (default: the scenario's)")
      ->type_name("N");
  command
      ->add_flag("--keep-samples{true}", arguments->keep_samples,
                 "Keep what the event sensors saw, for esim resense, with an error of the brightness up to 0.0005; "
                 "--keep-samples=exact: without error, but larger. The same as --set output.samples=true or exact")
      ->check(CLI::IsMember({"true", "exact"}));
  CLI::Option* const cache =
      command
          ->add_option(
              "--cache", arguments->images.folder,
              "Folder of the images that Blender or UnrealCV has rendered, so that none is rendered twice. For "
              "UnrealCV, use one folder per scene (default: ~/.cache/esim/images for scenes that esim opens in "
              "Blender, no cache for others)")
          ->type_name("DIR");
  CLI::Option* const cache_size =
      command->add_option("--cache-size", arguments->images.max_bytes, "Maximum size of this folder (default: 10GB)")
          ->transform(CLI::AsSizeValue(true))
          ->type_name("SIZE");
  command->add_flag("--no-cache", arguments->no_cache, "Render every image")->excludes(cache)->excludes(cache_size);
  command->footer(
      "Examples:\n"
      "  esim simulate scenes/room.yaml --out out/room\n"
      "  esim simulate scenes/room.yaml --out out/room --keep-samples     for other sensors later: esim resense "
      "--help\n"
      "  esim simulate --resume out/room                                   after it was interrupted or killed\n"
      "  esim simulate scenes/room.yaml --out out/fine --set sampling.lambda=0.1 --set duration_s=1 --seed 7");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

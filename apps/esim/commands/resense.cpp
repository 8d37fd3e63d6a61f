#include <fmt/format.h>

#include <filesystem>

#include "commands.h"
#include "esim/compose/compose.h"
#include "esim/scenario/read.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

struct ResenseArguments : RunOptions {
  std::string recording;
  std::string out;
};

int run(const ResenseArguments& arguments) {
  catch_interrupts();
  ProgressBar bar(!arguments.quiet);
  const Resensed made = resense({.recording = arguments.recording,
                                 .out = arguments.out,
                                 .replace = arguments.force,
                                 .threads = arguments.threads,
                                 .overrides = arguments.overrides,
                                 .setter = kSetter,
                                 .repetition = {shell_command(own_command_line())}},
                                printing(arguments.quiet), [&](const Progress& progress) {
                                  bar.show(progress);
                                  return !interrupted();
                                });
  bar.clear();
  const Summary& summary = made.summary;
  if (!arguments.quiet) {
    std::int64_t events = 0;
    for (const CameraSummary& camera : summary.cameras) events += camera.events();
    const double simulated_s = to_seconds(summary.end - summary.start);
    tell(stderr, "{}: {:.3f} s in {:.1f} s ({:.2f}x real time), {} events\nrecording: {}\n",
         summary.complete ? "done" : "interrupted", simulated_s, summary.wall_seconds,
         simulated_s / summary.wall_seconds, events, arguments.out);
  }
  return summary.complete ? kOk : kInterrupted;
}

}  // namespace

void add_resense(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ResenseArguments>();
  CLI::App* command =
      app.add_subcommand("resense", "Make new events from the samples of a recording, without rendering again");
  command->add_option("recording", arguments->recording, "Recording made with --keep-samples")
      ->required()
      ->type_name("RECORDING");
  command->add_option("-o,--out", arguments->out, "Folder to write")->required()->type_name("DIR");
  add_run_options(
      *command, *arguments,
      "Change event_camera, event_cameras, light.white_lux or output; event_camera.preset replaces all options of "
      "the sensors");
  command->footer(
      "Says whether the events are exactly those of a simulation with the new sensors. The recording out/room of the\n"
      "examples: esim simulate scenes/room.yaml --out out/room --keep-samples\n"
      "\n"
      "Examples:\n"
      "  esim resense out/room --out out/high --set event_camera.contrast_threshold=0.4\n"
      "  esim resense out/room --out out/davis --set event_camera.preset=davis346\n"
      "  esim resense out/room --out out/grid --set 'event_camera.contrast_threshold={values: [0.2, 0.3, 0.4]}'");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

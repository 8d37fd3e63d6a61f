#include <fmt/format.h>

#include "command_line.h"
#include "commands.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

struct VideoArguments : RunOptions {
  ConversionOptions options;
  std::string input, out, interpolator;
};

void report_held(const ConversionSummary& summary, const ConversionOptions& options, const Notices& notices) {
  if (summary.held == 0) return;
  notices.warning(
      fmt::format("between {} of {} pairs of frames, the motion is too large for {} steps (up to {:.0f} px); "
                  "raise --lambda or --max-steps, or use a video with more frames per second",
                  summary.held, summary.frames - 1, options.interpolation.max_steps, summary.max_optical_flow_px));
}

/// Options that the user has not tried and that would spread events that bunch at the frames.
std::string ways_to_spread(const ConversionOptions& options) {
  if (!options.interpolation.interpolation) return "without --no-interpolation, edges would move between the frames";
  constexpr double kFineLambda_px = 0.25;
  std::string ways;
  if (options.event_camera.low_pass_hz == 0 && !options.event_camera.circuit)
    ways =
        "the pixels of a real camera (--set preset=davis346), or a limited bandwidth (--set low_pass_hz=50), spread "
        "them";
  if (options.interpolation.lambda > kFineLambda_px)
    ways += fmt::format("{}smaller steps (--lambda {}) help a little", ways.empty() ? "" : "; ", kFineLambda_px);
  return ways.empty() ? "the rest comes from noise and aliasing of the frames" : ways;
}

void report_bunching(const ConversionSummary& summary, const ConversionOptions& options, const Notices& notices) {
  constexpr double kMuch = 0.1;  // as for "strong" banding in `esim stats`
  if (!summary.modulation || *summary.modulation < kMuch) return;
  notices.note(fmt::format("events bunch at the frames: between two frames their rate varies by {:.0f} % rms; {}",
                           100 * *summary.modulation, ways_to_spread(options)));
}

void print_summary(const ConversionSummary& summary) {
  const double converted_s = to_seconds(summary.end - summary.start);
  tell(stderr, "{}: {} frames, {:.3f} s, converted in {:.1f} s ({:.2f}x real time), {} steps, {} events\n",
       summary.complete ? "done" : "interrupted", summary.frames, converted_s, summary.wall_seconds,
       converted_s / summary.wall_seconds, summary.steps, summary.events_on + summary.events_off);
  tell(stderr, "{}", describe(filtered_cameras(summary)));
}

/// The exit code. Throws UserError if a problem ended the conversion early.
int outcome(const ConversionSummary& summary, const fs::path& out) {
  if (!summary.problem.empty()) {
    throw UserError(fmt::format("{}; the {} frames before this error are kept in {}, marked incomplete",
                                summary.problem, summary.frames, out.string()));
  }
  return summary.complete ? kOk : kInterrupted;
}

int run(VideoArguments& arguments) {
  std::error_code error;
  ConversionOptions& options = arguments.options;
  options.event_camera = read_event_camera(arguments.overrides);
  options.input = fs::absolute(arguments.input, error);
  if (!arguments.interpolator.empty()) options.interpolator = fs::absolute(arguments.interpolator, error).string();
  const fs::path name = fs::path(arguments.input).lexically_normal();
  const fs::path out = arguments.out.empty() ? "out" / (name.has_filename() ? name : name.parent_path()).stem()
                                             : fs::path(arguments.out);
  catch_interrupts();

  ProgressBar bar(!arguments.quiet);
  ConversionOutput output;
  output.out = out;
  output.replace = arguments.force;
  output.threads = arguments.threads;
  output.repetition = {shell_command(own_command_line())};
  output.comment = [&](const ConversionSummary& summary, const Notices& notices) {
    bar.clear();
    report_held(summary, options, notices);
    report_bunching(summary, options, notices);
  };
  const auto [summary, report] =
      make_conversion(options, std::move(output), printing(arguments.quiet), [&](const Progress& progress) {
        bar.show(progress);
        return !interrupted();
      });
  if (!arguments.quiet) {
    print_summary(summary);
    if (fs::is_directory(out, error)) {
      tell(stderr, "recording: {}\nlook at:   {}\n", out.string(), (out / kConversionCamera / "preview.png").string());
    } else {
      tell(stderr, "events: {}\n", out.string());
    }
  }
  return outcome(summary, out);
}

}  // namespace

void add_video(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<VideoArguments>();
  CLI::App* command = app.add_subcommand("video", "Convert a video, or a folder of images, to events");
  command
      ->add_option("input", arguments->input,
                   "Video file, or folder of images with images.csv (ns, file), timestamps.txt (s) or --fps")
      ->required()
      ->type_name("INPUT");
  command
      ->add_option("-o,--out", arguments->out,
                   "Recording folder or event file (.h5, .txt, ...) to write (default: out/NAME of the input)")
      ->type_name("FILE_OR_DIR");
  CommandLine options(*command);
  describe_command_line(options, arguments->options);
  command
      ->add_option(
          "--interpolator", arguments->interpolator,
          "Model in ONNX that makes the images between frames; needs the Python package of esim with onnxruntime")
      ->type_name("MODEL.onnx")
      ->excludes("--no-interpolation");
  add_run_options(*command, *arguments,
                  "Change one option of the event camera, for example --set contrast_threshold=0.2");
  command->footer(
      "Examples:\n"
      "  esim video clip.mp4 --out out/clip                        then look at out/clip/cam0/preview.png\n"
      "  esim video clip.mp4 --out events.h5 --set contrast_threshold=0.2\n"
      "  esim video images/ --fps 240 --out out/images\n"
      "  esim video slow.mp4 --slow-motion 8 --start 2 --duration 1.5 --out out/slow\n"
      "  esim video clip.mp4 --interpolator model.onnx --lambda 1  frames between frames by a neural network");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

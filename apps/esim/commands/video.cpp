#include <fmt/format.h>

#include <algorithm>

#include "command_line.h"
#include "commands.h"
#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/recording/fan_out.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"
#include "esim/recording/recording_file.h"
#include "esim/stats/between_frames.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

struct VideoArguments : RunOptions {
  ConversionOptions options;
  std::string input, out;
};

void report_losses(const ConversionSummary& summary, const ConversionOptions& options, const Notices& notices) {
  if (summary.held > 0) {
    notices.warning(
        fmt::format("between {} of {} pairs of frames, the motion is too large for {} steps (up to {:.0f} px); "
                    "raise --lambda or --max-steps, or use a video with more frames per second",
                    summary.held, summary.frames - 1, options.interpolation.max_steps, summary.max_optical_flow_px));
  }
  std::ranges::for_each(losses(options, summary), notices.warning);
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

/// A conversion from the opened input to the summary.
class Converter {
 public:
  explicit Converter(const VideoArguments& arguments)
      : arguments_(arguments),
        workers_(arguments.threads),
        frames_(arguments.input, arguments.options.video, arguments.options.bayer) {}

  ConversionSummary run(std::unique_ptr<Sink> out) {
    const ConversionOptions& options = arguments_.options;
    Interpolator interpolator(options.interpolation, options.event_camera.dark_light());
    EventCamera event_camera(options.event_camera, frames_.width(), frames_.height(), options.seed, 0);
    auto watching = std::make_unique<BetweenFrames>();
    const BetweenFrames& between_frames = *watching;
    FanOut both;
    both.add(std::move(out));
    both.add(std::move(watching));
    ProgressBar bar(!arguments_.quiet);
    ConversionSummary summary =
        convert({frames_, interpolator, event_camera, workers_}, both, [&](const Progress& progress) {
          bar.show(progress);
          has_converted_ = true;
          return !interrupted();
        });
    bar.clear();
    const PhaseTest test = between_frames.test();
    if (test.banding != Banding::unknown) summary.modulation = test.modulation;
    return summary;
  }

  int threads() const { return workers_.threads(); }

  /// Whether anything has been converted.
  const bool& has_converted() const { return has_converted_; }

 private:
  const VideoArguments& arguments_;
  Workers workers_;
  FrameSequence frames_;
  bool has_converted_ = false;
};

/// The exit code. Throws UserError if a problem ended the conversion early.
int outcome(const ConversionSummary& summary, const fs::path& out) {
  if (!summary.problem.empty()) {
    throw UserError(fmt::format("{}; the {} frames before this error are kept in {}, marked incomplete",
                                summary.problem, summary.frames, out.string()));
  }
  return summary.complete ? kOk : kInterrupted;
}

int convert_to_file(const VideoArguments& arguments, const fs::path& out, const Format& format,
                    const Notices& notices) {
  if (arguments.options.event_camera.labels && !format.can_hold(Content::event_labels)) {
    throw UserError(
        fmt::format("event_camera.labels: {} cannot hold the labels of events; choose another format, such "
                    "as dsec or npz, or a folder",
                    format.name));
  }
  RecordingFile file(out, arguments.force);
  Converter converter(arguments);
  const ConversionSummary summary = keep_on_failure(file, converter.has_converted(), [&] {
    ConversionSummary converted = converter.run(build_conversion_sink(file.path(), format));
    file.finish();
    return converted;
  });
  report_losses(summary, arguments.options, notices);
  report_bunching(summary, arguments.options, notices);
  if (!arguments.quiet) {
    print_summary(summary);
    tell(stderr, "events: {}\n", out.string());
  }
  return outcome(summary, out);
}

int convert_to_folder(const VideoArguments& arguments, const fs::path& out, const Notices& notices,
                      const std::vector<std::string>& given) {
  RecordingDirectory directory(out, arguments.force);
  ProvenanceRecorder provenance({shell_command(own_command_line())});
  const UsedFilesListener listener([&](const UsedFile& file) { provenance.add(file); });
  Converter converter(arguments);
  write_text(directory.path() / "video.yaml", write_conversion(arguments.options));
  const ConversionSummary summary = keep_on_failure(directory, converter.has_converted(), [&] {
    ConversionSummary converted = converter.run(build_conversion_sink(directory.path()));
    report_losses(converted, arguments.options, notices);
    report_bunching(converted, arguments.options, notices);
    directory.finish(
        report_json(arguments.options, converted, converter.threads(), given, provenance.finish(converted.complete)));
    return converted;
  });
  if (!arguments.quiet) {
    print_summary(summary);
    tell(stderr, "recording: {}\nlook at:   {}\n", out.string(), (out / kConversionCamera / "preview.png").string());
  }
  return outcome(summary, out);
}

int run(VideoArguments& arguments) {
  std::error_code error;
  arguments.options.event_camera = read_event_camera(arguments.overrides);
  arguments.options.input = fs::absolute(arguments.input, error);
  std::vector<std::string> given;
  const Notices notices = print_and_keep(given, arguments.quiet);
  std::ranges::for_each(warnings_of_filters(arguments.options.event_camera), notices.warning);
  catch_interrupts();
  warn_of_noise("", arguments.options.event_camera, notices);

  const fs::path name = fs::path(arguments.input).lexically_normal();
  const fs::path out = arguments.out.empty() ? "out" / (name.has_filename() ? name : name.parent_path()).stem()
                                             : fs::path(arguments.out);
  const Format* format = find_format_for(out);
  if (format != nullptr && !format->folder) return convert_to_file(arguments, out, *format, notices);
  return convert_to_folder(arguments, out, notices, given);
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
  add_run_options(*command, *arguments,
                  "Change one option of the event camera, for example --set contrast_threshold=0.2");
  command->footer(
      "Examples:\n"
      "  esim video clip.mp4 --out out/clip                        then look at out/clip/cam0/preview.png\n"
      "  esim video clip.mp4 --out events.h5 --set contrast_threshold=0.2\n"
      "  esim video images/ --fps 240 --out out/images\n"
      "  esim video slow.mp4 --slow-motion 8 --start 2 --duration 1.5 --out out/slow");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <future>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"
#include "esim/preview/video_file.h"
#include "esim/recording/recording_file.h"
#include "esim/visualise/playable.h"
#include "esim/visualise/player.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr int kSheetColumns = 3, kSheetRows = 3;
constexpr int kWidthOfGif = 960;           // px; limits the file size
constexpr double kMaxFramesOfGif_hz = 50;  // browsers slow down faster ones

struct PlayArguments {
  std::string input, out, camera;
  std::vector<std::string> views;
  double window_ms = 0, tau_ms = 0, span_ms = 0;
  std::optional<double> fps, at_s;
  std::optional<SensorSize> sensor;
  Extent extent;
  PlayOptions play;
  bool light = false, quiet = false, force = false;
};

// The default path: FILE.play.mp4 next to FILE.h5, FOLDER.play.mp4 next to a folder; .webp without FFmpeg.
fs::path out_path(const PlayArguments& arguments) {
  if (!arguments.out.empty()) return arguments.out;
  const char* const ending = can_write(VideoKind::mp4) ? ".play.mp4" : ".play.webp";
  const fs::path file = fs::path(arguments.input + "/").parent_path();  // without a slash at its end
  if (fs::is_directory(file)) return fs::path(file) += ending;
  return fs::path(file).replace_extension(ending);
}

// The kind of video with this ending; empty for .png, an image.
std::optional<VideoKind> kind_of(const fs::path& out) {
  const std::string extension = out.extension().string();
  if (extension == ".png") return std::nullopt;
  if (extension == ".mp4") return VideoKind::compact_mp4;
  if (extension == ".gif") return VideoKind::gif;
  if (extension == ".webp") return VideoKind::webp;
  throw UserError(fmt::format("--out {}: must end in .mp4, .gif, .webp or .png", out.string()));
}

/// One output, from the overview to the finished file.
class Showing {
 public:
  Showing(const PlayArguments& arguments, const Playable& input, const RecordingOverview& found, const fs::path& out)
      : arguments_(arguments), overview_(found), source_(input.open()), bar_(!arguments.quiet), out_(out) {
    options_ = choose_missing(arguments.play, found);
  }

  int still() {
    if (!arguments_.at_s) return contact_sheet();
    const TimeNs t = overview_.origin + to_ns(*arguments_.at_s);
    if (t < overview_.start || t > overview_.end) {
      throw UserError(fmt::format("--at {}: must be within the shown time, from {} to {} s", *arguments_.at_s,
                                  to_seconds(overview_.start - overview_.origin),
                                  to_seconds(overview_.end - overview_.origin)));
    }
    Player player(*source_, arguments_.extent.camera, overview_, options_, {.first = t});
    write_png(*player.next());
    say(fmt::format("t = {:g} s", *arguments_.at_s));
    return kOk;
  }

  int video(VideoKind kind) {
    const Instants instants = video_instants(overview_, options_);
    Player player(*source_, arguments_.extent.camera, overview_, options_, instants);
    RecordingFile file(out_, arguments_.force);
    VideoFile video(file.path(), player.layout().width, player.layout().height, options_.frames_per_s, kind);
    std::size_t frames = 0;
    std::future<void> encoding;  // of one image, while the next is drawn
    while (!interrupted()) {
      auto image = player.next();
      if (encoding.valid()) encoding.get();
      if (!image) break;
      encoding = std::async(std::launch::async, [&video, picture = *std::move(image)] { video.append(picture); });
      ++frames;
      show(frames, instants.count);
    }
    if (encoding.valid()) encoding.get();
    video.close();
    file.finish();
    bar_.clear();
    const bool complete = frames == instants.count;
    say(fmt::format(
        "{}{} frames, {:.2f} s at {}", complete ? "" : "interrupted, ", frames,
        static_cast<double>(frames) / options_.frames_per_s,
        options_.slow_motion == 1 ? "real time" : fmt::format("1/{:g} of real time", options_.slow_motion)));
    return complete ? kOk : kInterrupted;
  }

 private:
  int contact_sheet() {
    if (arguments_.play.views.empty()) options_.views = {View::events};
    if (options_.views.size() != 1)
      throw UserError("a contact sheet shows one view only; give one --view, or a time with --at");
    options_.width = options_.width > 0 ? options_.width : 620;
    constexpr std::size_t kCount = kSheetColumns * kSheetRows;
    // The centres of equal intervals.
    const double step_ns = static_cast<double>(overview_.end - overview_.start) / kCount;
    const Instants instants{overview_.start + static_cast<TimeNs>(0.5 * step_ns), step_ns, kCount};
    Player player(*source_, arguments_.extent.camera, overview_, options_, instants);
    std::vector<CaptionedPicture> pictures;
    for (std::size_t i = 0; i < kCount && !interrupted(); ++i) {
      pictures.push_back(
          {*player.next_picture(), fmt::format("t = {:.4f} s", to_seconds(instants.at(i) - overview_.origin))});
      show(i + 1, kCount);
    }
    bar_.clear();
    if (pictures.empty()) return kInterrupted;
    write_png(draw_contact_sheet(pictures, kSheetColumns, options_.theme));
    say(fmt::format("{} times", pictures.size()));
    return interrupted() ? kInterrupted : kOk;
  }

  void write_png(const Image<Rgb>& image) { write_file_atomically(out_, encode_png(image)); }

  void show(std::size_t frame, std::size_t of) {
    bar_.show(static_cast<double>(frame) / static_cast<double>(of),
              [&] { return fmt::format("{}/{} frames", frame, of); });
  }

  void say(const std::string& what) {
    if (arguments_.quiet) return;
    tell(stderr, "{}: {}; {} events\n", out_.string(), what, grouped(overview_.events));
  }

  const PlayArguments& arguments_;
  const RecordingOverview& overview_;
  PlayOptions options_;
  std::unique_ptr<Source> source_;
  ProgressBar bar_;
  fs::path out_;
};

int run(PlayArguments& arguments) {
  const fs::path out = out_path(arguments);
  const std::optional<VideoKind> kind = kind_of(out);
  if (kind && !can_write(*kind))
    throw UserError(
        fmt::format("--out {}: must end in .webp or .png, since this esim was built without FFmpeg", out.string()));
  if (fs::exists(out) && (!arguments.force || fs::is_directory(out)))
    throw UserError(out.string() + " exists; choose another --out, or replace a file with --force");
  if (arguments.at_s && kind) throw UserError("--at gives a single image; add --out FILE.png");

  PlayOptions& play = arguments.play;
  play.views = views_named(arguments.views);
  play.window_s = 1e-3 * arguments.window_ms;
  play.tau_s = 1e-3 * arguments.tau_ms;
  play.span_s = 1e-3 * arguments.span_ms;
  play.frames_per_s = arguments.fps.value_or(kind == VideoKind::gif ? 20 : 30);
  if (kind == VideoKind::gif && play.frames_per_s > kMaxFramesOfGif_hz)
    throw UserError(fmt::format("--fps: must be at most {} for a GIF; lower it", kMaxFramesOfGif_hz));
  if (kind == VideoKind::gif && play.width == 0) play.width = kWidthOfGif;
  play.theme = arguments.light ? kLightTheme : kDarkTheme;

  catch_interrupts();
  const Playable input(arguments.input, arguments.sensor);
  play.name = input.name();
  arguments.extent.camera = input.camera(arguments.camera);
  ProgressBar bar(!arguments.quiet);
  const auto found = read_overview(*input.open(), arguments.extent, [&](double fraction) {
    bar.show(fraction, [&] { return fmt::format("reading, {:.0f} %", 100 * fraction); });
    return !interrupted();
  });
  bar.clear();
  if (!found) return kInterrupted;
  Showing showing(arguments, input, *found, out);
  return kind ? showing.video(*kind) : showing.still();
}

}  // namespace

void add_play(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<PlayArguments>();
  CLI::App* command = app.add_subcommand("play", "Make a video or an image of events");
  const auto positive = [&](const char* name, auto& value, const char* help, const char* unit, double min, double max) {
    return command->add_option(name, value, help)->type_name(unit)->check(CLI::Range(min, max));
  };
  command->add_option("in", arguments->input, "Recording folder, or file of events of any format")
      ->required()
      ->type_name("IN");
  command
      ->add_option(
          "-o,--out", arguments->out,
          "File to write (default: NAME.play.mp4 next to IN). A .png file shows a contact sheet, or with --at a "
          "single time")
      ->type_name("FILE.mp4|.gif|.webp|.png");
  command
      ->add_option(
          "--view", arguments->views,
          "Views to show side by side: events, time-surface, space-time, image, depth, motion (default: all available)")
      ->type_name("VIEW,...")
      ->delimiter(',');
  positive("--fps", arguments->fps, "Frames per second of the video (default: 30, for GIFs 20)", "F", 1, 240);
  positive("--slow-motion", arguments->play.slow_motion,
           "Slow-motion factor; below 1 is faster than real time (default: so that the video lasts at least about 4 s)",
           "F", 1e-3, 1e6);
  auto* window =
      positive("--window-ms", arguments->window_ms,
               "Time window of the shown events (default: depends on their rate, 1 to 50 ms)", "MS", 1e-3, 1e6);
  positive("--window-events", arguments->play.window_events, "Show the latest N events instead of a time window", "N",
           1, 8e6)
      ->excludes(window);
  positive("--tau-ms", arguments->tau_ms, "Decay time of the time surface (default: 1.5 windows)", "MS", 1e-3, 1e6);
  positive("--span-ms", arguments->span_ms, "Time span of the space-time plot (default: 20 windows)", "MS", 1e-3, 1e6);
  positive("--start", arguments->extent.start_s, "Start time, relative to the start of the recording", "S", 0, 1e9);
  positive("--duration", arguments->extent.duration_s, "Duration after the start time", "S", 1e-6, 1e9);
  positive("--at", arguments->at_s, "Time of a single image, relative to the start of the recording", "S", 0, 1e9);
  positive("--size", arguments->play.width, "Width of the image (default: 960 to 1920, for GIFs 960)", "PX", 128, 7680);
  command->add_option("--camera", arguments->camera, "Camera to show, if there are several")->type_name("NAME");
  add_sensor_options(*command, arguments->sensor);
  command->add_flag("--light", arguments->light, "White background, for print");
  command->add_flag("-q,--quiet", arguments->quiet, "Print warnings and errors only");
  command->add_flag("--force", arguments->force, "Replace an existing file");
  command->footer(
      "Examples:\n"
      "  esim play out/room                                      then look at out/room.play.mp4\n"
      "  esim play events.h5 --view space-time --out cube.gif --duration 0.5\n"
      "  esim play events.txt --out sheet.png                    nine times in one image\n"
      "  esim play out/room --out moment.png --at 0.25 --light   one time, for print");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

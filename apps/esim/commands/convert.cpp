#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <map>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "esim/formats/copy_recording.h"
#include "esim/formats/formats.h"
#include "progress_bar.h"
#include "remedies.h"
#include "support.h"

namespace esim::app {
namespace {

struct ConvertArguments {
  std::string input, out, format;
  CopyOptions copy;
  std::optional<SensorSize> sensor;
  bool recover = false, list = false, quiet = false, force = false;
};

int list_formats() {
  for (const Format& format : all_formats()) {
    std::string extensions = format.folder ? "folder" : "";
    for (const std::string& extension : format.extensions) extensions += format.folder ? "" : extension + " ";
    fmt::print("{:<14} {:<10} {}{}\n", format.name, extensions, format.description,
               format.create ? "" : " (read only)");
  }
  return kOk;
}

void print_summary(const CopySummary& summary, const ConvertArguments& arguments, double wall_s) {
  std::string copied;
  for (const auto& [content, count] : summary.copied)
    copied += fmt::format("{}{} {}", copied.empty() ? "" : ", ", grouped(count), describe(content));
  tell(stderr, "{}: {} in {:.1f} s: {}\n", summary.complete ? "done" : "interrupted",
       copied.empty() ? "nothing" : copied, wall_s, arguments.out);
}

int run(const ConvertArguments& arguments, const CLI::App& command) {
  if (arguments.list) return list_formats();
  if (arguments.out.empty()) throw UserError("IN or OUT is missing; write: esim convert IN OUT");
  const auto start = std::chrono::steady_clock::now();
  const std::filesystem::path out = arguments.out;
  const Format& format = arguments.format.empty() ? format_for(out) : format_named(arguments.format);
  ConvertOptions options{arguments.copy, {arguments.sensor, {}}, arguments.force};
  if (arguments.recover) {
    options.read.recover = [](const std::string& problem) {
      tell(stderr, "warning: {}; everything before it is converted\n", problem);
    };
  }
  catch_interrupts();
  ProgressBar bar(!arguments.quiet);
  const CopySummary summary = convert_recording(arguments.input, format, out, options, [&](double fraction) {
    bar.show(fraction, [&] { return fmt::format("{:.0f} %", 100 * fraction); });
    return !interrupted();
  });
  bar.clear();
  for (const Loss& loss : losses(summary, format))
    tell(stderr, "warning: {}\n", with_remedy(loss.what, loss.remedy, command));
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  if (!arguments.quiet) print_summary(summary, arguments, wall.count());
  return interrupted() ? kInterrupted : kOk;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* command = app.add_subcommand("convert", "Convert recordings and event files between formats");
  command->add_flag("--list", arguments->list, "List the formats");
  command
      ->add_option("in", arguments->input,
                   "Recording or event file of any format; esim detects the format from the content")
      ->type_name("IN");
  command->add_option("out", arguments->out, "File or folder to write")->type_name("OUT");
  command->add_option("-f,--format", arguments->format, "Format to write (default: by the extension of OUT)")
      ->type_name("NAME");
  command->add_option("--camera", arguments->copy.camera, "Convert this camera only")->type_name("NAME");
  command->add_flag("--from-zero", arguments->copy.from_zero, "Write times relative to the start of the recording");
  command->add_option("--time-unit", arguments->copy.write.unit, "Unit of event times, if the format allows a choice")
      ->transform(CLI::CheckedTransformer(std::map<std::string, TimeUnit>{{"us", TimeUnit::us}, {"ns", TimeUnit::ns}})
                      .description(""))
      ->type_name("us|ns");
  command->add_option("--compression", arguments->copy.write.compression, "Of HDF5")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Compression>{{"blosc", Compression::blosc},
                                                                             {"gzip", Compression::gzip},
                                                                             {"none", Compression::none}})
                      .description(""))
      ->type_name("blosc|gzip|none");
  add_sensor_options(*command, arguments->sensor);
  command->add_flag("--recover", arguments->recover, "Convert the readable part of a damaged file");
  command->add_flag("-q,--quiet", arguments->quiet, "Print warnings and errors only");
  command->add_flag("--force", arguments->force, "Replace an existing OUT");
  command->footer(
      "Examples:\n"
      "  esim convert out/room room.bag                                  a complete recording, for ROS\n"
      "  esim convert out/room/cam0/events.h5 events.raw                 Prophesee's EVT 3.0\n"
      "  esim convert out/room flow --format kitti                       optical flow and depth as images\n"
      "  esim convert events.txt events.h5 --width 640 --height 480 --time-unit ns\n"
      "  esim convert cut.h5 whole.h5 --recover                          the readable part of a damaged file\n"
      "  esim convert --list");
  command->callback([arguments, command, &exit_code] { exit_code = run(*arguments, *command); });
}

}  // namespace esim::app

#include <fmt/format.h>

#include "commands.h"
#include "copying.h"
#include "esim/core/error.h"
#include "esim/formats/formats.h"

namespace esim::app {
namespace {

struct ConvertArguments : CopyArguments {
  bool list = false;
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

int run(const ConvertArguments& arguments, const CLI::App& command) {
  if (arguments.list) return list_formats();
  if (arguments.out.empty()) throw UserError("IN or OUT is missing; write: esim convert IN OUT");
  return run_copy(arguments, command, [&](const Format& format, const ConvertOptions& options, const auto& go_on) {
    return convert_recording(arguments.input, format, arguments.out, options, go_on);
  });
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
  add_copy_options(*command, *arguments, "Convert");
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

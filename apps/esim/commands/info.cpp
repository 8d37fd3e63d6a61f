#include <fmt/format.h>

#include "commands.h"
#include "esim/formats/inspect.h"

namespace esim::app {

void add_info(CLI::App& app, int& exit_code) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("info", "Describe the contents of a recording or of an event file");
  command->add_option("file", *path, "Recording folder, or file of any format in esim convert --list")
      ->required()
      ->type_name("FILE");
  command->footer("Examples:\n  esim info out/room\n  esim info out/room/cam0/events.h5");
  command->callback([path, &exit_code] {
    fmt::print("{}", describe(inspect(*path)));
    exit_code = kOk;
  });
}

}  // namespace esim::app

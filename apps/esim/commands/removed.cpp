#include "commands.h"
#include "esim/core/error.h"

namespace esim::app {

void add_removed(CLI::App& app) {
  CLI::App* command = app.add_subcommand("waypoints", "")->group("");  // not in the help
  command->set_help_flag();
  command->allow_extras();
  command->callback([] {
    throw UserError("waypoints: this command was removed; set waypoints in a browser with esim studio SCENARIO.yaml");
  });
}

}  // namespace esim::app

#include "esim/studio/studio.h"

#include <fmt/format.h>

#include <csignal>
#include <filesystem>

#include "commands.h"
#include "esim/core/error.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

struct StudioArguments : studio::StudioOptions {
  std::string input, page;
  std::vector<std::string> folders;
};

int run(StudioArguments& arguments) {
  arguments.opened = arguments.input;
  arguments.roots.assign(arguments.folders.begin(), arguments.folders.end());
  arguments.pages =
      arguments.page.empty() ? data_folder("studio", ESIM_PAGE_BUILT, "index.html") : fs::path(arguments.page);

  // Blocked in all threads; this one waits for them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  if (!is_ignored(SIGHUP)) sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  const studio::Studio studio(arguments);
  fmt::print("{}\n", studio.url());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&signals, &signal);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // a second signal ends the program at once
  return kOk;
}

}  // namespace

void add_studio(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<StudioArguments>();
  CLI::App* command = app.add_subcommand("studio", "Design, make and view recordings in a browser");
  command
      ->add_option("in", arguments->input,
                   "Scenario, scene file, recording or folder to open (default: the current folder)")
      ->type_name("IN");
  command
      ->add_option("--root", arguments->folders,
                   "Additional folder whose files the studio may read and write, besides that of IN")
      ->type_name("DIR")
      ->expected(1)
      ->take_all();
  command->add_option("--port", arguments->port, "Port to listen on (default: 8391, or the next free port)")
      ->type_name("N")
      ->check(CLI::Range(1, 65535));
  command->add_option("--host", arguments->host, "Address to listen on; any other than 127.0.0.1 needs --token")
      ->capture_default_str()
      ->type_name("ADDRESS");
  command
      ->add_option("--token", arguments->token,
                   "Access token: anyone who knows it may use the studio (default: random)")
      ->type_name("TEXT");
  command
      ->add_option(
          "--page", arguments->page,
          "Folder of the page (default: share/esim/studio next to the program, or the output of scripts/studio)")
      ->type_name("DIR");
  command->add_option("-j,--threads", arguments->threads, "Number of threads; 0 uses every processor")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->footer(
      "Prints an address to open in a browser on this machine; Ctrl-C ends the studio.\n\n"
      "Examples:\n"
      "  esim studio scenes/room.yaml            edit a scenario and see the effect\n"
      "  esim studio room.glb                    begin a new scenario with this scene\n"
      "  esim studio out/room                    view a recording, of any format in esim convert --list\n"
      "  esim studio scenes/room.yaml --root ~/data --port 9000\n"
      "To use it from another machine, run ssh -L 8391:127.0.0.1:8391 HOST there, and open the address.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

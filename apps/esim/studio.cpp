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

struct Arguments : studio::StudioOptions {
  std::string input, page;
  std::vector<std::string> folders;
};

/// Where the page lies as seen from this program, wherever it was moved: as it is installed, beside it in an unpacked
/// archive, or in the tree that it was built in.
fs::path page_folder() {
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path installed = (folder / ESIM_PAGE_INSTALLED).lexically_normal();
  for (const fs::path& page : {installed, folder / "share/esim/studio", folder / ESIM_PAGE_BUILT}) {
    if (fs::is_regular_file(page / "index.html", error)) return page.lexically_normal();
  }
  return installed;
}

int run(Arguments& arguments) {
  arguments.opened = arguments.input;
  arguments.roots.assign(arguments.folders.begin(), arguments.folders.end());
  arguments.pages = arguments.page.empty() ? page_folder() : fs::path(arguments.page);

  // All threads leave these signals to this one, which waits for them.
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
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // a second one ends the program at once
  return kOk;
}

}  // namespace

void add_studio(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("studio", "Design a recording in a browser, make it, and look at it");
  command->add_option("in", arguments->input, "Scenario, scene file, recording, or folder to open (default: this one)")
      ->type_name("IN");
  command->add_option("--root", arguments->folders, "Folder of files that may be read and written, beside that of IN")
      ->type_name("DIR")
      ->expected(1)
      ->take_all();
  command->add_option("--port", arguments->port, "Where to listen (default: 8391, or the next that is free)")
      ->type_name("N")
      ->check(CLI::Range(1, 65535));
  command
      ->add_option("--host", arguments->host,
                   "Address to listen on; for another than this machine's own, --token is needed")
      ->capture_default_str()
      ->type_name("ADDRESS");
  command->add_option("--token", arguments->token, "Whoever knows it may use the studio (default: new, random)")
      ->type_name("TEXT");
  command
      ->add_option("--page", arguments->page,
                   "Folder of the page (default: share/esim/studio beside the program, or as scripts/studio builds it)")
      ->type_name("DIR");
  command->add_option("-j,--threads", arguments->threads, "Threads; 0 takes every processor")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->footer(
      "Prints an address to be opened in a browser on this machine; Ctrl-C ends it.\n\n"
      "Examples:\n"
      "  esim studio scenes/room.yaml            change it, and see what it does\n"
      "  esim studio room.glb                    begin a scenario with a scene\n"
      "  esim studio out/room                    look at a recording, of any format that esim convert --list names\n"
      "  esim studio scenes/room.yaml --root ~/data --port 9000\n"
      "From another machine: ssh -L 8391:127.0.0.1:8391 HOST, and open the address there.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

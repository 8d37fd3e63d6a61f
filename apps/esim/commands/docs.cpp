#include <filesystem>

#include "commands.h"
#include "esim/core/error.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

/// The first page of the site if scripts/docs has built it, otherwise the folder of the Markdown files.
fs::path documentation() {
  const fs::path site = data_folder("site", ESIM_SITE_BUILT, "index.html") / "index.html";
  if (fs::exists(site)) return site;
  const fs::path folder = data_folder("docs", ESIM_DOCS_BUILT, "getting-started.md");
  if (!fs::exists(folder / "getting-started.md"))
    throw UserError(folder.string() + ": the documentation is missing; install esim again");
  return folder;
}

}  // namespace

void add_docs(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("docs", "Print where the documentation is");
  command->footer(
      "Prints the first page of the site if `scripts/docs` built it before esim was installed, otherwise the folder\n"
      "of the same pages in Markdown.\n"
      "\n"
      "Examples:\n"
      "  esim docs                               the path of the documentation\n"
      "  xdg-open \"$(esim docs)\"                 opens it");
  command->callback([&exit_code] {
    tell(stdout, "{}\n", documentation().string());
    exit_code = kOk;
  });
}

}  // namespace esim::app

#include <algorithm>
#include <filesystem>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

fs::path scenes_folder() {
  const fs::path folder = data_folder("scenes", ESIM_SCENES_BUILT, "poster.yaml");
  if (!fs::exists(folder / "poster.yaml"))
    throw UserError(folder.string() + ": the scenes are missing; install esim again");
  return folder;
}

void list(const fs::path& folder) {
  std::vector<std::string> scenarios;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") scenarios.push_back(entry.path().string());
  }
  std::sort(scenarios.begin(), scenarios.end());
  for (const std::string& scenario : scenarios) tell(stdout, "{}\n", scenario);
}

/// The copies are writable, even if the originals are not.
void copy_scenes(const fs::path& folder, const fs::path& to) {
  std::error_code error;
  if (fs::exists(to, error)) throw UserError(to.string() + " exists; choose another --copy, or remove it");
  fs::create_directory(to, error);
  if (error) throw_cannot_write(to, error.message() + "; choose another --copy");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path copy = to / entry.path().lexically_relative(folder);
    if (entry.is_directory()) {
      fs::create_directory(copy, error);
    } else {
      fs::copy_file(entry.path(), copy, error);
      if (!error) fs::permissions(copy, fs::perms::owner_write, fs::perm_options::add, error);
    }
    if (error) throw_cannot_write(copy, error.message());
  }
}

}  // namespace

void add_scenes(CLI::App& app, int& exit_code) {
  auto to = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("scenes", "List the scenarios that come with esim, or copy them");
  command->add_option("--copy", *to, "New folder to copy the scenarios and their scenes to, for example ./scenes")
      ->type_name("DIR");
  command->footer(
      "Examples:\n"
      "  esim scenes                             the paths of the scenarios\n"
      "  esim scenes --copy scenes               copies of them, to change\n"
      "  esim simulate scenes/poster.yaml --out out/poster");
  command->callback([to, &exit_code] {
    const fs::path folder = scenes_folder();
    if (to->empty()) {
      list(folder);
    } else {
      copy_scenes(folder, *to);
      list(*to);
    }
    exit_code = kOk;
  });
}

}  // namespace esim::app

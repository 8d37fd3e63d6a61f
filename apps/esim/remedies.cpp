#include "remedies.h"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "esim/scenario/suggest.h"

namespace esim::app {
namespace {

struct Advice {
  const char* flag;  // of the command; empty: of any command
  const char* text;
};

Advice advice_on(Remedy remedy) {
  switch (remedy) {
    case Remedy::replace_output:
      return {"--force", ", or pass --force to replace it"};
    case Remedy::choose_camera:
      return {"--camera", " with --camera"};
    case Remedy::extract_camera:
      return {"", ", with esim convert --camera"};
    case Remedy::times_from_zero:
      return {"--from-zero", ", or pass --from-zero"};
    case Remedy::nanoseconds:
      return {"--time-unit", "; --time-unit ns keeps them"};
    case Remedy::sensor_size:
      return {"--width", " with --width and --height"};
    case Remedy::shorter_video:
      return {"--slow-motion", " (--start, --duration, --slow-motion)"};
    case Remedy::shift_times:
      return {"--shift", "; shift the second one with --shift SECONDS"};
    case Remedy::keep_samples:
      return {"", " (esim simulate --keep-samples)"};
    case Remedy::none:
      break;
  }
  return {"", ""};
}

}  // namespace

std::string with_remedy(const std::string& message, Remedy remedy, const CLI::App& command) {
  for (const CLI::App* given : command.get_subcommands()) return with_remedy(message, remedy, *given);
  const auto [flag, text] = advice_on(remedy);
  if (*flag != '\0' && command.get_option_no_throw(flag) == nullptr) return message;
  return message + text;
}

std::string problem_of(const CLI::ParseError& error, const CLI::App& app) {
  const CLI::App* command = &app;
  std::string path = app.get_name();
  for (auto given = app.get_subcommands(); !given.empty(); given = command->get_subcommands()) {
    command = given.front();
    path += " " + command->get_name();
  }
  const std::string help = fmt::format(" (see {} --help)", path);
  const std::vector<std::string> unknown = app.remaining(true);

  std::vector<std::string> commands, options;
  for (const CLI::App* known : command->get_subcommands([](const CLI::App*) { return true; })) {
    if (!known->get_group().empty()) commands.push_back(known->get_name());
  }
  for (const CLI::Option* known : command->get_options()) {
    for (const std::string& name : known->get_lnames()) options.push_back("--" + name);
  }
  const auto refuse = [&](const std::string& kind, const std::string& word, const std::vector<std::string>& known) {
    const std::string similar = nearest(word, known);
    const std::string advice =
        similar.empty() ? fmt::format("{}s are {}", kind, list(known)) : fmt::format("did you mean {}?", similar);
    return fmt::format("{} has no {} {}; {}", path, kind, word, advice) + help;
  };
  for (const std::string& word : unknown) {
    if (word.starts_with("-")) return refuse("option", word.substr(0, word.find('=')), options);
  }
  if (commands.empty()) return error.what() + help;
  if (unknown.empty()) return fmt::format("{} needs a command, one of {}", path, list(commands)) + help;
  return refuse("command", unknown.front(), commands);
}

}  // namespace esim::app

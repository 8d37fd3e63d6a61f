#include "remedies.h"

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

}  // namespace esim::app

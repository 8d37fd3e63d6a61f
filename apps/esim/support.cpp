#include "support.h"

#include <fmt/format.h>

#include <csignal>
#include <fstream>

#include "esim/core/error.h"

namespace esim::app {
namespace {

volatile std::sig_atomic_t signal_came = 0;

void on_signal(int) { signal_came = 1; }

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (!is_ignored(SIGHUP)) std::signal(SIGHUP, on_signal);
  std::signal(SIGPIPE, SIG_IGN);
}

bool is_ignored(int signal) {
  struct sigaction now {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

void write_or_not(std::FILE* file, const std::string& text) noexcept { std::fputs(text.c_str(), file); }

std::filesystem::path data_folder(const std::string& name, const std::string& built, const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path installed = (program / ESIM_DATA_INSTALLED / name).lexically_normal();
  for (const fs::path& folder : {installed, program / "share/esim" / name, program / built}) {
    if (fs::exists(folder / file, error)) return folder.lexically_normal();
  }
  return installed;
}

bool interrupted() { return signal_came != 0; }

Notices printing(bool quiet) {
  return {[](const std::string& text) { tell(stderr, "warning: {}\n", text); },
          [quiet](const std::string& text) {
            if (!quiet) tell(stderr, "{}\n", text);
          }};
}

Notices print_and_keep(std::vector<std::string>& given, bool quiet) { return keeping(printing(quiet), given); }

void add_run_options(CLI::App& command, RunOptions& options, const std::string& set_help) {
  command.add_option("--set", options.overrides, set_help)->type_name("KEY=VALUE")->expected(1)->take_all();
  command
      .add_option("-j,--threads", options.threads,
                  "Number of threads; 0 uses every processor. The result does not depend on it")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command.add_flag("-q,--quiet", options.quiet, "Print warnings and errors only");
  command.add_flag("--force", options.force, "Replace an existing recording in --out");
}

void add_sensor_options(CLI::App& command, std::optional<SensorSize>& sensor) {
  const auto add = [&](const char* name, int SensorSize::*side, const char* help) {
    const auto set = [&sensor, side](int px) {
      if (!sensor) sensor.emplace();
      (*sensor).*side = px;
    };
    return command.add_option_function<int>(name, set, help)->type_name("PX")->check(CLI::Range(1, 65536));
  };
  CLI::Option* width = add("--width", &SensorSize::width, "Width of the sensor (default: from the file)");
  CLI::Option* height = add("--height", &SensorSize::height, "Height of the sensor (default: from the file)");
  width->needs(height);
  height->needs(width);
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw OutputError(fmt::format("{}: cannot be written; is the disk full?", path.string()));
}

}  // namespace esim::app

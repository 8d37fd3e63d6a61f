#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/evaluate/paper_scenario.h"
#include "esim/evaluate/report/evaluation_text.h"
#include "esim/evaluate/report/report_files.h"
#include "esim/evaluate/schemes.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"
#include "esim/scenario/read.h"
#include "esim/scenario/sampling_text.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRotation = "rotation.txt";

struct EvaluateArguments : RunOptions {
  std::string scenario = "scenes/panorama.yaml", panorama, out, pixels = "400";
  std::vector<std::string> schemes;
  SamplingEvaluationOptions options;
  bool quick = false;
};

/// The scenario to evaluate. Writes the files of the built-in scenario into `folder`.
Scenario base_scenario(const EvaluateArguments& arguments, const fs::path& folder) {
  if (arguments.panorama.empty()) return read_scenario(arguments.scenario, arguments.overrides);
  if (!arguments.overrides.empty())
    throw UserError("--set: changes SCENARIO.yaml, which --panorama replaces; remove one of them");
  write_text(folder / kRotation, paper_rotation());
  return paper_scenario(fs::absolute(arguments.panorama), folder / kRotation);
}

/// The scenario with paths for the folder's final name.
Scenario to_keep(Scenario scenario, const EvaluateArguments& arguments, const fs::path& folder) {
  if (!arguments.panorama.empty())
    std::get<FileTrajectoryOptions>(scenario.trajectory).path = fs::absolute(folder / kRotation);
  return scenario;
}

int number_of_pixels(const std::string& text) {
  if (text == "all") return 0;
  int count = 0;
  if (!CLI::detail::lexical_cast(text, count) || count < 1)
    throw UserError(fmt::format("--pixels {}: must be a number of at least 1, or all", text));
  return count;
}

/// Current step and remaining time: one line on a terminal, otherwise nothing.
class StatusLine {
 public:
  explicit StatusLine(bool wanted) : on_terminal_(wanted && isatty(STDERR_FILENO) == 1) {}

  void show(double fraction, const std::string& what) {
    const auto now = std::chrono::steady_clock::now();
    if (!on_terminal_ || now - shown_ < std::chrono::milliseconds(100)) return;
    shown_ = now;
    const double elapsed_s = std::chrono::duration<double>(now - start_).count();
    const int left_s = fraction > 0.01 ? static_cast<int>(elapsed_s * (1 - fraction) / fraction) : -1;
    const std::string left = left_s < 0 ? "-:--" : fmt::format("{}:{:02}", left_s / 60, left_s % 60);
    tell(stderr, "\r\033[K[{:3.0f} %] {}  {} left", 100 * fraction, what, left);
    std::fflush(stderr);
  }
  void clear() const {
    if (on_terminal_) tell(stderr, "\r\033[K");
  }

 private:
  bool on_terminal_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), shown_;
};

/// Prints a line of the table when a scheme is done.
class Table {
 public:
  explicit Table(bool wanted) : wanted_(wanted) {}

  void add_line(const SamplingEvaluation& so_far) const {
    if (!wanted_) return;
    if (so_far.schemes.size() == 1) tell(stdout, "{}", text_header(so_far));
    tell(stdout, "{}", text_line(so_far.schemes.back()));
    std::fflush(stdout);
  }

 private:
  bool wanted_;
};

int run(EvaluateArguments arguments) {
  SamplingEvaluationOptions& options = arguments.options;
  options.pixels = number_of_pixels(arguments.pixels);
  options.threads = arguments.threads;
  for (const std::string& text : arguments.schemes) options.schemes.push_back(read_sampling(text));
  if (options.schemes.empty()) options.schemes = arguments.quick ? quick_schemes() : default_schemes();

  std::vector<std::string> given;
  const Notices notices = print_and_keep(given, arguments.quiet);
  catch_interrupts();
  RecordingDirectory directory(arguments.out, arguments.force);
  Scenario scenario = base_scenario(arguments, directory.path());
  if (arguments.quick) make_quick(scenario, options);
  StatusLine status(!arguments.quiet);
  const Table table(!arguments.quiet);
  EvaluationMonitor monitor;
  monitor.progress = [&](double fraction, const std::string& what) {
    status.show(fraction, what);
    return !interrupted();
  };
  monitor.scheme_done = [&](const SamplingEvaluation& so_far) {
    status.clear();
    table.add_line(so_far);
  };
  const auto evaluation = evaluate_sampling(scenario, options, notices, monitor);
  status.clear();
  if (!evaluation) return kInterrupted;
  keep_on_failure(directory, true, [&] {
    write_text(directory.path() / "scenario.yaml",
               write_scenario(to_keep(scenario, arguments, directory.final_path())));
    write_report_files(*evaluation, directory.path());
    directory.finish(to_json(*evaluation));
  });
  if (!arguments.quiet) {
    tell(stdout, "{}", goal_text(*evaluation));
    tell(stderr, "report: {}\n", (fs::path(arguments.out) / "report.md").string());
  }
  return kOk;
}

void add_sampling(CLI::App& evaluate, int& exit_code) {
  auto arguments = std::make_shared<EvaluateArguments>();
  SamplingEvaluationOptions& options = arguments->options;
  CLI::App* command = evaluate.add_subcommand(
      "sampling", "Measure the accuracy and cost of sampling methods, as in Section 4.1 of the ESIM paper");
  auto* file = command
                   ->add_option("scenario", arguments->scenario,
                                "Scenario file; each scheme replaces its sampling (default: scenes/panorama.yaml)")
                   ->type_name("SCENARIO.yaml");
  command
      ->add_option("--panorama", arguments->panorama,
                   "Instead: the paper's random rotations in this equirectangular 8-bit image")
      ->type_name("IMAGE")
      ->excludes(file);
  command->add_option("-o,--out", arguments->out, "Folder to write")->required()->type_name("DIR");
  command
      ->add_option("--scheme", arguments->schemes,
                   "Sampling method, for example 'flow lambda=0.5'; may be given several times (default: a list)")
      ->type_name("SCHEME")
      ->expected(1)
      ->take_all();
  command->add_option("--pixels", arguments->pixels, "Number of pixels at which brightness is compared, or all")
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--truth-rays", options.truth_rays,
                   "samples_per_pixel of the reference brightness (default: the scenario's)")
      ->check(CLI::IsMember({1, 16, 64}));
  command->add_option("--truth-rate", options.truth_rate_hz, "Sampling rate of the reference brightness, Hz")
      ->check(CLI::Range(100.0, 1e7))
      ->capture_default_str();
  command->add_option("--window", options.window_s, "Length of the windows of slowest and fastest motion, s")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  command
      ->add_option("--event-span", options.event_span_s,
                   "Duration in each window over which events are compared, s; 0: no comparison")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  command->add_option("--event-rate", options.event_rate_hz, "Uniform sampling rate of the reference events, Hz")
      ->check(CLI::Range(1e3, 1e7))
      ->capture_default_str();
  command->add_option("--goal", options.rmse_goal, "RMSE at which the cost is interpolated")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  command->add_flag("--quick", arguments->quick, "A short run with few schemes and pixels");
  add_run_options(*command, *arguments, "Change one option of SCENARIO.yaml, for example --set duration_s=1");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
  command->footer(
      "Examples:\n"
      "  esim evaluate sampling scenes/panorama.yaml --out out/sampling\n"
      "  esim evaluate sampling --panorama bicycle_parking.jpg --out out/paper\n"
      "  esim evaluate sampling scenes/room.yaml --out out/room --scheme 'uniform rate_hz=500' --scheme 'flow "
      "lambda=1'\n"
      "Then look at report.md in the folder.");
}

}  // namespace

void add_evaluate(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Measure the accuracy of a simulation, and how real its sensors are");
  command->require_subcommand(1);
  command->footer("Example:\n  esim evaluate sampling scenes/room.yaml --out out/room --quick");
  add_sampling(*command, exit_code);
  add_realism(*command, exit_code);
}

}  // namespace esim::app

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/files/folder_plan.h"
#include "esim/files/number_text.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"
#include "esim/sweep/table.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOver = "--over ";

struct SweepArguments {
  std::string scenario, out;
  std::vector<std::string> over, overrides;
  std::uint64_t max_runs = 1000;
  int jobs = 0, threads = 0;
  bool quiet = false;
};

SweepPlan read_plan(const SweepArguments& arguments) {
  SweepOptions options{arguments.scenario, arguments.overrides, {}, kOver};
  for (const std::string& text : arguments.over)
    options.over.push_back(read_swept_option(text, arguments.max_runs, kOver));
  if (const std::uint64_t runs = number_of_runs(options.over); runs > arguments.max_runs) {
    throw UserError(fmt::format("--over: {} runs, but --max-runs is {}; give fewer values, or raise it", grouped(runs),
                                grouped(arguments.max_runs)));
  }
  return plan_sweep(options, ESIM_VERSION);
}

/// Sets how many simulations run at the same time, and their threads.
void divide_processors(const SweepArguments& arguments, const SweepPlan& plan, SweepWork& work) {
  const bool engine = std::ranges::any_of(plan.simulations, [](const SweptSimulation& simulation) {
    return engine_objects(simulation.scenario.renderer) != nullptr;
  });
  if (engine && arguments.jobs > 1)
    throw UserError("--jobs: must be 1 for renderers that are other programs; remove it");
  const int processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const int simulations = static_cast<int>(plan.simulations.size());
  constexpr int kMaxJobs = 8;  // each needs its own memory
  work.jobs = arguments.jobs > 0 ? arguments.jobs : engine ? 1 : std::min(processors, kMaxJobs);
  work.jobs = std::min(work.jobs, simulations);
  work.threads = arguments.threads > 0 ? arguments.threads : std::max(1, processors / work.jobs);
}

std::string number_of(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", grouped(count), what, count == 1 ? "" : "s");
}

int run(const SweepArguments& arguments) {
  const SweepPlan plan = read_plan(arguments);
  SweepWork work{.folder = arguments.out, .repetition = {shell_command(own_command_line())}};
  divide_processors(arguments, plan, work);
  begin_or_continue(work.folder, {"sweep", "sweep.json", plan.json});
  const std::size_t before = complete_simulations(plan, work.folder);
  if (!arguments.quiet) {
    tell(stderr, "{} in {}{}; {} at a time, {} each\n", number_of(plan.runs.size(), "run"),
         number_of(plan.simulations.size(), "simulation"),
         before > 0 ? fmt::format(", of which {} complete", before) : "", work.jobs,
         number_of(static_cast<std::size_t>(work.threads), "thread"));
    if (plan.separated_by_samples) {
      tell(stderr,
           "hint: the sampling, or flickering light, depends on the thresholds of the event sensors, so that runs with "
           "other thresholds are rendered separately; without flicker, flow sampling renders once for all: --set "
           "'sampling={{type: flow}}'\n");
    }
  }

  catch_interrupts();
  ProgressBar bar(!arguments.quiet);
  const Notices notices = printing(true);
  SweepMonitor monitor;
  const auto clearing = [&](const NoticeHandler& handler) {
    return [&bar, handler](const std::string& text) {
      bar.clear();
      handler(text);
    };
  };
  monitor.notices = {clearing(notices.warning), [](const std::string&) {}};
  monitor.progress = [&](const SweepProgress& p) {
    bar.show(p.fraction, [&] {
      return fmt::format("{}/{} simulations  {} events", p.complete, p.all,
                         grouped(static_cast<std::uint64_t>(p.events)));
    });
    return !interrupted();
  };
  monitor.made = [&](const SweptSimulation& simulation, const Summary& summary, const SweepProgress& p) {
    if (arguments.quiet) return;
    bar.clear();
    const std::string runs = simulation.runs.size() == 1 ? values_of(plan, simulation.runs.front())
                                                         : number_of(simulation.runs.size(), "run");
    tell(stderr, "{}/{}  {}: {} in {:.1f} s\n", p.complete, p.all, simulation.name, runs, summary.wall_seconds);
  };
  const auto rows = [&] {
    try {
      return run_sweep(plan, work, monitor);
    } catch (const OutputError& error) {
      bar.clear();
      throw OutputError(fmt::format("{}; complete simulations stay in {}, and the same command continues from them",
                                    error.what(), arguments.out));
    } catch (...) {
      bar.clear();
      throw;
    }
  }();
  bar.clear();
  if (!rows) {
    tell(stderr, "interrupted: {} of {} are complete in {}; the same command continues\n",
         complete_simulations(plan, work.folder), number_of(plan.simulations.size(), "simulation"), arguments.out);
    return kInterrupted;
  }
  write_file_atomically(work.folder / "sweep.csv", to_csv(plan, *rows));
  const auto figure = draw_rates(plan, *rows);
  if (figure) write_file_atomically(work.folder / "sweep.png", encode_png(*figure));
  if (arguments.quiet) return kOk;
  tell(stdout, "{}", describe(plan, *rows));
  tell(stderr, "table: {}\n", (work.folder / "sweep.csv").string());
  if (figure) tell(stderr, "look at: {}\n", (work.folder / "sweep.png").string());
  return kOk;
}

}  // namespace

void add_sweep(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SweepArguments>();
  CLI::App* command =
      app.add_subcommand("sweep", "Simulate a scenario with every combination of values of some options");
  command->add_option("scenario", arguments->scenario, "Scenario file (YAML)")->required()->type_name("SCENARIO.yaml");
  command
      ->add_option("--over", arguments->over,
                   "An option and its values, or a range of whole numbers; may be given several times: then every "
                   "combination is a run")
      ->required()
      ->type_name("KEY=VALUE,VALUE,...|KEY=FIRST..LAST")
      ->expected(1)
      ->take_all();
  command->add_option("-o,--out", arguments->out, "Folder to write; an incomplete sweep is continued")
      ->required()
      ->type_name("DIR");
  command->add_option("--set", arguments->overrides, "Change one option of all runs")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->take_all();
  command->add_option("--max-runs", arguments->max_runs, "Maximum number of runs (default: 1000)")
      ->type_name("N")
      ->check(CLI::Range(1U, 1'000'000U));
  command
      ->add_option(
          "--jobs", arguments->jobs,
          "Number of simulations at the same time (default: one per processor, at most 8; one if another program "
          "renders). Each needs its own memory for the scene")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("-j,--threads", arguments->threads,
                   "Number of threads of each simulation (default: the processors, divided among the jobs)")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command->add_flag("-q,--quiet", arguments->quiet, "Print warnings and errors only");
  command->footer(
      "Examples:\n"
      "  esim sweep scenes/room.yaml --over event_camera.contrast_threshold=0.1,0.2,0.3 --out out/thresholds\n"
      "  esim sweep scenes/room.yaml --over event_camera.shot_noise_hz=0,1,10 --over event_camera.seed=1..5 --out "
      "out/noise\n"
      "  esim sweep scenes/room.yaml --over 'sampling={type: flow},{type: uniform, rate_hz: 500}' --set duration_s=1 "
      "--out out/sampling\n"
      "Runs of which only event_camera differs share a rendering if that does not change their events. The same "
      "command "
      "again\n"
      "makes missing simulations. Results: sweep.csv, sweep.png, and a recording for each simulation.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

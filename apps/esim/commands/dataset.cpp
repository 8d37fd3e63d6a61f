#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "commands.h"
#include "esim/core/error.h"
#include "esim/dataset/cluster.h"
#include "esim/dataset/files/manifest.h"
#include "esim/dataset/generators/affine_sequences.h"
#include "esim/dataset/generators/scenario_sequences.h"
#include "esim/dataset/produce.h"
#include "esim/files/number_text.h"
#include "esim/files/output_file.h"
#include "esim/scenario/conversion.h"
#include "esim/scenario/sampling_text.h"
#include "progress_bar.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAffine = "affine";

struct DatasetArguments {
  std::string what, out, check, share;
  std::uint32_t count = 10'000, shard_size = 0, sensors = 1;
  std::uint64_t seed = 1;
  std::string format = "hdf5";
  std::vector<std::string> contents, overrides;
  int workers = 0;
  bool quiet = false;

  // Of affine motion.
  AffineOptions affine;
  std::string images, histogram, motion_field_at = "middle", sampling;
  std::vector<double> thresholds, mix;

  // Of Slurm.
  bool slurm = false;
  std::uint32_t slurm_tasks = 8;
  std::string slurm_options;
};

std::unique_ptr<SequenceMaker> make_affine(const DatasetArguments& arguments) {
  AffineOptions options = arguments.affine;
  options.images = arguments.images;
  options.seed = arguments.seed;
  if (!arguments.histogram.empty()) options.magnitudes = read_magnitudes(arguments.histogram);
  if (!arguments.sampling.empty()) options.sampling = read_sampling(arguments.sampling);
  if (!arguments.thresholds.empty())
    options.contrast_threshold = {arguments.thresholds.front(), arguments.thresholds.back()};
  if (!arguments.mix.empty()) options.mix = {arguments.mix[0], arguments.mix[1], arguments.mix[2], arguments.mix[3]};
  for (std::size_t i = 0; i < kEnumNames<MotionFieldTime>.size(); ++i) {
    if (arguments.motion_field_at == kEnumNames<MotionFieldTime>[i])
      options.motion_field_at = static_cast<MotionFieldTime>(i);
  }
  options.event_camera = read_event_camera(arguments.overrides);
  options.sensors = arguments.sensors;
  return std::make_unique<AffineSequences>(std::move(options));
}

/// The command line of this process without the options for Slurm.
std::vector<std::string> own_command() {
  std::vector<std::string> words;
  bool is_value = false;  // of an option for Slurm
  for (const std::string& word : own_command_line()) {
    if (!is_value && !word.starts_with("--slurm")) words.push_back(word);
    is_value = !is_value && (word == "--slurm-tasks" || word == "--slurm-options");
  }
  words.front() = fs::read_symlink("/proc/self/exe").string();
  return words;
}

int submit(const DatasetArguments& arguments, const DatasetFolder& folder) {
  SlurmJob job;
  job.tasks = std::min(arguments.slurm_tasks, folder.plan().shards());
  job.folder = fs::absolute(folder.path());
  job.working_folder = fs::current_path();
  job.command = own_command();
  std::istringstream options(arguments.slurm_options);
  for (std::string option; options >> option;) job.options.push_back(option);
  const fs::path script = job.folder / "slurm.sh";
  write_file_atomically(script, slurm_script(job));
  const int status = std::system(("sbatch " + shell_quoted(script.string())).c_str());
  if (status == -1 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw UserError(fmt::format(
        "sbatch failed for {}; submit it on a machine with Slurm, or change its options with --slurm-options",
        script.string()));
  }
  return kOk;
}

int check(const DatasetArguments& arguments) {
  const DatasetFolder folder(arguments.check);
  const std::vector<std::string> problems = check_dataset(folder);
  for (const std::string& problem : problems) tell(stderr, "{}\n", problem);
  if (!problems.empty()) {
    tell(stderr, "esim: {}: {} problem{}\n", arguments.check, problems.size(), problems.size() == 1 ? "" : "s");
    return kUsersFault;
  }
  const DatasetState state = survey_dataset(folder);
  fmt::print("{}: complete: {} sequences, {} events, {:.1f} GB in {} files\n", arguments.check,
             grouped(state.sequences), grouped(state.events), static_cast<double>(state.bytes) * 1e-9,
             state.shards.size());
  return kOk;
}

void report(const DatasetState& state, const fs::path& out) {
  std::map<std::string, std::string> passed_over;
  for (const ShardRecord& record : state.shards)
    passed_over.insert(record.passed_over.begin(), record.passed_over.end());
  if (!passed_over.empty()) {
    tell(stderr, "warning: {} image{} could not be used, for example: {}\n", passed_over.size(),
         passed_over.size() == 1 ? "" : "s", passed_over.begin()->second);
  }
  tell(stderr, "{}: complete; look at {}\n", out.string(), (out / "preview.png").string());
}

int run(DatasetArguments arguments) {
  if (!arguments.check.empty()) return check(arguments);
  if (arguments.what.empty()) throw UserError("the kind of dataset is missing; give affine, or a scenario file");
  if (arguments.out.empty()) throw UserError("--out: is missing; name a folder");
  const bool affine = arguments.what == kAffine;
  std::vector<std::string> names = arguments.contents;
  if (names.empty()) names = {"motion_field", "optical_flow"};
  for (const std::string& name : names) {
    if (const std::string present = present_content_name(name); present != name)
      tell(stderr, "warning: --contents: {} is now {}\n", name, present);
  }
  DatasetPlan plan{.count = arguments.count,
                   .shard_size = arguments.shard_size,
                   .format = arguments.format == "hdf5" ? ShardFormat::hdf5 : ShardFormat::webdataset,
                   .contents = contents_named(names)};
  const Share share = share_named(arguments.share);
  const std::unique_ptr<SequenceMaker> maker =
      affine ? make_affine(arguments)
             : std::make_unique<ScenarioSequences>(arguments.what, arguments.overrides, arguments.seed,
                                                   plan.contents.optical_flow, arguments.sensors);
  if (plan.shard_size == 0) {
    const std::uint32_t usual = usual_shard_size(arguments.count), sensors = maker->sensors();
    plan.shard_size = (usual + sensors - 1) / sensors * sensors;  // files do not divide the sequences of a rendering
  }
  plan.maker = maker->options();
  if (share.part == 0) SequenceArrays(maker->make(0), plan.contents);  // a sample, before anything is written
  const DatasetFolder folder(arguments.out, plan, ESIM_VERSION);
  if (arguments.slurm) return submit(arguments, folder);

  catch_interrupts();
  const int workers = arguments.workers > 0    ? arguments.workers
                      : slurm_processors() > 0 ? slurm_processors()
                                               : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  ProgressBar bar(!arguments.quiet);
  const auto begun = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(); };
  const auto show = [&](const ProductionProgress& p) {
    const std::uint32_t wanted = p.all - (p.done - p.made);
    bar.show(wanted > 0 ? static_cast<double>(p.made) / wanted : 1.0, [&] {
      return fmt::format("{}/{} sequences  {:.1f}/s  {} events", p.done, p.all, p.made / std::max(seconds(), 1e-9),
                         grouped(p.events));
    });
    return !interrupted();
  };
  const Production production = [&] {
    try {
      return produce(folder, *maker, share, workers, show);
    } catch (const OutputError& error) {
      throw OutputError(fmt::format("{}; complete files stay in {}, and the same command continues from them",
                                    error.what(), arguments.out));
    }
  }();
  bar.clear();
  if (!arguments.quiet) {
    tell(stderr, "{}: made {} sequences in {:.1f} s, {:.1f} per second\n", arguments.out, production.progress.made,
         seconds(), production.progress.made / std::max(seconds(), 1e-9));
  }
  if (interrupted()) return kInterrupted;
  if (!production.complete() && !arguments.quiet)
    tell(stderr, "{}: {} files are being written by another process\n", arguments.out, production.elsewhere);
  const DatasetState state = survey_dataset(folder);
  if (!state.complete()) return kOk;
  write_manifest(folder, state, maker->magnitudes(), maker->is_target());
  if (!arguments.quiet) report(state, arguments.out);
  return kOk;
}

void add_affine_options(CLI::App& command, DatasetArguments& arguments) {
  const char* const kGroup = "Affine motion";
  AffineOptions& affine = arguments.affine;
  const auto add = [&](const char* name, auto& value, const char* help, const char* type) {
    return command.add_option(name, value, help)->type_name(type)->group(kGroup);
  };
  add("--images", arguments.images, "Folder of images to move (default: generated dead-leaves images)", "DIR");
  add("--duration", affine.duration_s, "Duration of a sequence, s (default: 0.04)", "S");
  add("--width", affine.width, "Width of the sensor, px (default: 240)", "PX");
  add("--height", affine.height, "Height of the sensor, px (default: 180)", "PX");
  add("--flow-histogram", arguments.histogram,
      "Histogram of the optical flow over the duration: lines LOW HIGH WEIGHT, px (default: MPI Sintel's)", "FILE");
  add("--flow-scale", affine.flow_scale, "Factor on the histogram's magnitudes", "F");
  add("--motion-field-at", arguments.motion_field_at, "Time of the motion field: start, middle (default) or end",
      "TIME")
      ->check(CLI::IsMember({"start", "middle", "end"}));
  add("--flow-at", arguments.motion_field_at, "Old name of --motion-field-at", "TIME")
      ->check(CLI::IsMember({"start", "middle", "end"}))
      ->each([](const std::string&) { tell(stderr, "warning: --flow-at is now --motion-field-at\n"); })
      ->group("");
  add("--threshold", arguments.thresholds, "Range of the random contrast threshold of each sequence (default: 0.2 0.5)",
      "LOW [HIGH]")
      ->expected(1, 2);
  add("--mix", arguments.mix, "Relative strengths of translation, rotation, scale and shear (default: 1 0.5 0.3 0.2)",
      "T R S H")
      ->expected(4);
  add("--sampling", arguments.sampling, "Sampling method, as in a scenario (default: 'flow lambda=0.5')", "SAMPLING");
}

}  // namespace

void add_dataset(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DatasetArguments>();
  CLI::App* command = app.add_subcommand("dataset", "Make many labelled sequences for learning");
  command
      ->add_option("what", arguments->what,
                   "affine (random affine motion of images), or a scenario with the key randomise")
      ->type_name("affine|SCENARIO.yaml");
  command->add_option("-o,--out", arguments->out, "Folder to write; an incomplete dataset is continued")
      ->type_name("DIR");
  command->add_option("-n,--count", arguments->count, "Number of sequences (default: 10000)")
      ->type_name("N")
      ->check(CLI::Range(1U, 4'000'000'000U));
  command
      ->add_option("--contents", arguments->contents,
                   "Contents in addition to events: motion_field, optical_flow (default: both), images, tensor, "
                   "voxels=BINS, depth")
      ->type_name("NAME,...")
      ->delimiter(',');
  command->add_option("--format", arguments->format, "Format of the files: hdf5 (default) or webdataset")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"hdf5", "webdataset"}));
  command->add_option("--shard-size", arguments->shard_size, "Sequences per file (default: up to 100)")
      ->type_name("N")
      ->check(CLI::Range(1U, 1'000'000U));
  command
      ->add_option(
          "--sensors", arguments->sensors,
          "Event sensors per rendered sequence: K consecutive sequences show the same, with other random options "
          "of event_camera and other noise (default: 1)")
      ->type_name("K")
      ->check(CLI::Range(1U, 256U));
  command->add_option("--seed", arguments->seed, "Seed of all random numbers (default: 1)")->type_name("N");
  command
      ->add_option("--set", arguments->overrides,
                   "Change one option of the scenario; for affine motion, one option of event_camera")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->take_all();
  command
      ->add_option("-j,--workers", arguments->workers,
                   "Number of worker threads; 0 uses every processor. The result does not depend on it")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command->add_flag("-q,--quiet", arguments->quiet, "Print warnings and errors only");
  command
      ->add_option("--check", arguments->check,
                   "Instead: check that the dataset in DIR is complete; this reads all its files")
      ->type_name("DIR");
  add_affine_options(*command, *arguments);
  const char* const kCluster = "On a cluster";
  command
      ->add_option("--shard", arguments->share,
                   "Make part I of N of the files, with I from 0 to N - 1; auto/N takes I from SLURM_ARRAY_TASK_ID or "
                   "JOB_COMPLETION_INDEX. In a Slurm array, auto/N is the default")
      ->type_name("I/N")
      ->group(kCluster);
  command->add_flag("--slurm", arguments->slurm, "Submit the work to Slurm as an array of tasks, and exit")
      ->group(kCluster);
  command->add_option("--slurm-tasks", arguments->slurm_tasks, "Number of tasks of the array (default: 8)")
      ->type_name("N")
      ->check(CLI::Range(1U, 100'000U))
      ->group(kCluster);
  command->add_option("--slurm-options", arguments->slurm_options, "Additional options of sbatch")
      ->type_name("\"--time=1:00:00 ...\"")
      ->group(kCluster);
  command->footer(
      "Examples:\n"
      "  esim dataset affine --out flow                              10,000 sequences of 0.04 s, as in the paper\n"
      "  esim dataset affine --out flow --images photographs --contents motion_field,tensor --format webdataset\n"
      "  esim dataset room.yaml --count 500 --out rooms              from a scenario with the key randomise\n"
      "  esim dataset affine --out flow --slurm --slurm-tasks 50 --slurm-options \"--cpus-per-task=8\"\n"
      "  esim dataset --check flow                                   check that the dataset is complete\n"
      "The same command again makes missing files. Look at preview.png and magnitudes.png in the folder.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app

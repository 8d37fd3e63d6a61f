#include <algorithm>
#include <iterator>

#include "esim/compose/compose.h"
#include "esim/compose/recordings/checkpoints.h"
#include "esim/compose/samples/samples_file.h"
#include "esim/files/folder_plan.h"
#include "esim/files/output_file.h"
#include "esim/recording/fan_out.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"
#include "esim/scenario/read.h"

namespace esim::inline compose {
Notices keeping(Notices notify, std::vector<std::string>& given) {
  return {[warning = std::move(notify.warning), &given](const std::string& text) {
            given.push_back("warning: " + text);
            warning(text);
          },
          [note = std::move(notify.note), &given](const std::string& text) {
            given.push_back(text);
            note(text);
          }};
}

namespace {

constexpr const char* kScenarioFile = "scenario.yaml";

/// The checkpoint of a simulation that ended early, if it is one of this scenario.
Checkpoint checkpoint_of(const std::filesystem::path& recording, const std::string& scenario) {
  Checkpoint checkpoint = read_checkpoint(recording);
  require_same_scenario(read_text(recording / kScenarioFile).value_or(""), scenario);
  return checkpoint;
}

/// Removes the files that a simulation that is resumed writes again.
void remove_outputs(const std::filesystem::path& recording) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (std::filesystem::recursive_directory_iterator entry(recording, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::filesystem::path& path = entry->path();
    const bool is_kept = path.filename() == kScenarioFile || path.filename() == kSamplesFile ||
                         path.filename() == "report.json" || path == checkpoint_folder(recording);
    if (path == checkpoint_folder(recording)) entry.disable_recursion_pending();
    if (!is_kept && !entry->is_directory(error)) files.push_back(path);
  }
  for (auto file = files.begin(); file != files.end() && !error; ++file) std::filesystem::remove(*file, error);
  if (error) throw OutputError("cannot remove the files in " + recording.string() + ": " + error.message());
}

}  // namespace

std::optional<Summary> make_recording(const Scenario& scenario, RecordingOptions options, const Notices& notify,
                                      const Monitor& monitor) {
  std::vector<std::string> given;
  const Notices notices = keeping(notify, given);
  const std::string scenario_text = write_scenario(scenario);
  std::optional<Checkpoint> checkpoint;
  if (options.resume) checkpoint = checkpoint_of(RecordingDirectory::resumable(options.out), scenario_text);
  // The directory comes first, so that an existing one is reported before a scene is loaded.
  RecordingDirectory directory =
      options.resume ? RecordingDirectory::resume(options.out) : RecordingDirectory(options.out, options.replace);
  Checkpoint origin{
      .repetition = options.repetition, .working_folder = current_folder(), .scenario_files = scenario.files};
  if (checkpoint) {
    origin.repetition = checkpoint->repetition;
    origin.working_folder = checkpoint->working_folder;
    origin.scenario_files = checkpoint->scenario_files;
  }
  ProvenanceRecorder provenance(origin.repetition, origin.working_folder);
  provenance.add(origin.scenario_files);
  const UsedFilesListener listener([&](const UsedFile& file) {
    origin.inputs.push_back(file);
    provenance.add(file);
  });
  const auto cache = open_image_cache(options.images, scenario.renderer, notices.warning);
  World world = build_world(scenario, options.threads, notices, cache);
  if (checkpoint) {
    require_unchanged(*checkpoint, origin.inputs);
    remove_outputs(directory.path());
  }
  write_file_atomically(directory.path() / kScenarioFile, scenario_text);
  std::unique_ptr<Sink> sink = build_sink(scenario, directory.path());
  SampleStores samples(scenario, directory.path(), world,
                       checkpoint ? std::span(checkpoint->samples) : std::span<std::vector<std::byte>>{});
  if (options.beside != nullptr) {
    auto both = std::make_unique<FanOut>();
    both->add(std::move(sink));
    both->add(std::move(options.beside));
    sink = std::move(both);
  }
  std::optional<CheckpointWriter> writer;
  Checkpoints checkpoints{[&] { return writer->due(); },
                          [&](std::vector<std::byte> state) { writer->save(std::move(state), samples.state()); },
                          {}};
  if (scenario.output.checkpoints) {
    create_folder(checkpoint_folder(directory.path()));
    std::unique_ptr<RecordJournal> journal =
        checkpoint ? std::make_unique<RecordJournal>(journal_file(directory.path()), checkpoint->journal_bytes,
                                                     std::move(sink))
                   : std::make_unique<RecordJournal>(journal_file(directory.path()), std::move(sink));
    writer.emplace(directory.path(), *journal, std::move(origin));
    sink = std::move(journal);
    if (checkpoint) checkpoints.resumed = std::move(checkpoint->state);
  }
  if (!monitor({world.info.start, world.info.start, world.info.end, 0, 0, 0})) return std::nullopt;
  bool recorded = checkpoint.has_value();
  return keep_on_failure(directory, recorded, [&]() -> std::optional<Summary> {
    Summary summary = simulate(
        world, *sink,
        [&](const Progress& progress) {
          recorded |= progress.now > progress.start;
          return monitor(progress);
        },
        writer ? &checkpoints : nullptr);
    if (summary.complete) {
      samples.finish();
      std::error_code ignored;  // only space is lost
      std::filesystem::remove_all(checkpoint_folder(directory.path()), ignored);
    }
    summary.engine_images = engine_images(cache);
    for (const std::string& loss : losses(scenario, summary)) given.push_back("warning: " + loss);
    std::ranges::copy(hints(scenario, summary), std::back_inserter(given));
    directory.finish(
        report_json(scenario, summary, world.workers->threads(), given, provenance.finish(summary.complete)));
    return summary;
  });
}

}  // namespace esim::inline compose

#include <algorithm>
#include <iterator>

#include "esim/compose/compose.h"
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

std::optional<Summary> make_recording(const Scenario& scenario, RecordingOptions options, const Notices& notify,
                                      const Monitor& monitor) {
  std::vector<std::string> given;
  const Notices notices = keeping(notify, given);
  // The directory comes first, so that an existing one is reported before a scene is loaded.
  RecordingDirectory directory(options.out, options.replace);
  ProvenanceRecorder provenance(options.repetition);
  provenance.add(scenario.files);
  const UsedFilesListener listener([&](const UsedFile& file) { provenance.add(file); });
  const auto cache = open_image_cache(options.images, scenario.renderer, notices.warning);
  World world = build_world(scenario, options.threads, notices, cache);
  write_file_atomically(directory.path() / "scenario.yaml", write_scenario(scenario));
  std::unique_ptr<Sink> sink = build_sink(scenario, directory.path());
  SampleStores samples(scenario, directory.path(), world);
  if (options.beside != nullptr) {
    auto both = std::make_unique<FanOut>();
    both->add(std::move(sink));
    both->add(std::move(options.beside));
    sink = std::move(both);
  }
  if (!monitor({world.info.start, world.info.start, world.info.end, 0, 0, 0})) return std::nullopt;
  bool recorded = false;
  return keep_on_failure(directory, recorded, [&]() -> std::optional<Summary> {
    Summary summary = simulate(world, *sink, [&](const Progress& progress) {
      recorded |= progress.now > progress.start;
      return monitor(progress);
    });
    if (summary.complete) samples.finish();
    summary.engine_images = engine_images(cache);
    for (const std::string& loss : losses(scenario, summary)) given.push_back("warning: " + loss);
    std::ranges::copy(hints(scenario, summary), std::back_inserter(given));
    directory.finish(
        report_json(scenario, summary, world.workers->threads(), given, provenance.finish(summary.complete)));
    return summary;
  });
}

}  // namespace esim::inline compose

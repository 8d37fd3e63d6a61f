#include <algorithm>

#include "esim/compose/compose.h"
#include "esim/compose/samples/samples_file.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/sample_store/sample_store.h"

namespace esim::inline compose {

struct SampleStores::Store {
  SampleStoreWriter writer;
  const Workers& workers;
};

SampleStores::SampleStores(const Scenario& scenario, const std::filesystem::path& folder, World& world,
                           std::span<const std::vector<std::byte>> resumed) {
  if (scenario.output.samples == KeptSamples::none) return;
  const auto with_events = static_cast<std::size_t>(
      std::ranges::count_if(world.cameras, [](const CameraChannel& camera) { return !camera.event_sensors.empty(); }));
  if (!resumed.empty() && resumed.size() != with_events)
    throw UserError(folder.string() + ": the checkpoint has the samples of other cameras; simulate again");
  const bool rounded = scenario.output.samples == KeptSamples::rounded;
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    if (world.cameras[i].event_sensors.empty()) continue;
    const CameraInfo& camera = world.info.cameras[i];
    create_folder(folder / camera.name);
    const SampleStoreInfo info{camera.model.width, camera.model.height, world.info.start, world.info.end,
                               rounded ? SamplePrecision::rounded : SamplePrecision::exact};
    const std::filesystem::path file = folder / camera.name / kSamplesFile;
    stores_.push_back(std::make_unique<Store>(
        Store{resumed.empty() ? SampleStoreWriter(file, info) : SampleStoreWriter(file, info, resumed[stores_.size()]),
              *world.workers}));
    world.cameras[i].keep_samples = [store = stores_.back().get()](std::span<const Segment> segments,
                                                                   TimeNs watermark) {
      store->writer.add(segments, watermark, store->workers);
    };
  }
}

SampleStores::~SampleStores() = default;

std::vector<std::vector<std::byte>> SampleStores::state() {
  std::vector<std::vector<std::byte>> states;
  for (const auto& store : stores_) states.push_back(store->writer.state());
  return states;
}

void SampleStores::finish() {
  for (const auto& store : stores_) store->writer.finish(store->workers);
}

}  // namespace esim::inline compose

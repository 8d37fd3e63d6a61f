#include "esim/compose/compose.h"
#include "esim/compose/samples/samples_file.h"
#include "esim/files/output_file.h"
#include "esim/sample_store/sample_store.h"

namespace esim::inline compose {

struct SampleStores::Store {
  SampleStoreWriter writer;
  const Workers& workers;
};

SampleStores::SampleStores(const Scenario& scenario, const std::filesystem::path& folder, World& world) {
  if (scenario.output.samples == KeptSamples::none) return;
  const bool rounded = scenario.output.samples == KeptSamples::rounded;
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    if (world.cameras[i].event_sensors.empty()) continue;
    const CameraInfo& camera = world.info.cameras[i];
    create_folder(folder / camera.name);
    const SampleStoreInfo info{camera.model.width, camera.model.height, world.info.start, world.info.end,
                               rounded ? SamplePrecision::rounded : SamplePrecision::exact};
    stores_.push_back(
        std::make_unique<Store>(Store{SampleStoreWriter(folder / camera.name / kSamplesFile, info), *world.workers}));
    world.cameras[i].keep_samples = [store = stores_.back().get()](std::span<const Segment> segments,
                                                                   TimeNs watermark) {
      store->writer.add(segments, watermark, store->workers);
    };
  }
}

SampleStores::~SampleStores() = default;

void SampleStores::finish() {
  for (const auto& store : stores_) store->writer.finish(store->workers);
}

}  // namespace esim::inline compose

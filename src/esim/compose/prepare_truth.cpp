#include <fmt/format.h>

#include <cmath>

#include "esim/compose/compose.h"
#include "esim/core/error.h"

namespace esim::inline compose {
namespace {

void check_optical_flow(const TruthOptions& truth, PeriodicClock clock, double duration_s,
                        const RendererTraits& renderer) {
  if (!truth.optical_flow) return;
  if (renderer.on_sensor) {
    throw UserError(fmt::format(
        "truth.optical_flow: needs depth, but {} are drawn on the sensor and have none; remove it", renderer.name));
  }
  const bool has_frames = clock.due() != PeriodicClock::kNever;
  if (has_frames) clock.advance();
  if (clock.due() != PeriodicClock::kNever) return;
  throw UserError(fmt::format(
      "truth.optical_flow: needs two frames of ground truth, but truth.rate_hz = {} gives {} in {:.6g} s; raise "
      "truth.rate_hz",
      truth.rate_hz, has_frames ? 1 : 0, duration_s));
}

void check_event_points(const TruthOptions& truth, const RendererTraits& renderer) {
  if (truth.event_points && renderer.granularity == Granularity::frame) {
    throw UserError(fmt::format(
        "truth.event_points: needs single pixels at the time of each event, which {} cannot render; remove it",
        renderer.name));
  }
  if (truth.event_points && renderer.at_infinity) {
    throw UserError(fmt::format(
        "truth.event_points: needs finite depth, but everything in {} is infinitely far; remove it", renderer.name));
  }
}

/// Warns of very large ground truth: a rate in the wrong unit would fill the disk.
void warn_of_much(const Scenario& scenario, double duration_s, const Notices& notices) {
  constexpr double kMuch = 1e11;
  const TruthOptions& truth = scenario.truth;
  if (truth.rate_hz <= 0) return;
  double pixels = 0;
  for (const CameraOptions& camera : scenario.cameras) pixels += static_cast<double>(camera.width) * camera.height;
  const int bytes_per_pixel = (truth.images ? 1 : 0) + (truth.depth ? 4 : 0) + (truth.motion_field ? 8 : 0) +
                              (truth.optical_flow ? 9 : 0) + (truth.objects ? 2 : 0);
  const double frames = std::floor(duration_s * truth.rate_hz) + 1, bytes = frames * pixels * bytes_per_pixel;
  if (bytes <= kMuch) return;
  notices.warning(
      fmt::format("truth.rate_hz = {} makes {:.0f} frames for each camera, {:.0f} GB before compression; "
                  "check that it is in Hz",
                  truth.rate_hz, frames, bytes * 1e-9));
}

/// Renderers of the same scene for single pixels and their depth. They use the processor, since a graphics card would
/// draw the complete image for each pixel.
EventPoints::MakeRenderer for_single_pixels(RendererFactory make_renderer, RendererOptions options, SceneFile scene,
                                            const World& world, const Notices& notices) {
  if (auto* const mesh = std::get_if<MeshRendererOptions>(&options)) {
    mesh->engine = MeshEngine::raycast;
    mesh->samples_per_pixel = 1;
    scene.scene.lighting.reset();
    make_renderer = build_renderer_factory(options, scene, false, world.info.cameras, notices);
  } else if (auto* const splats = std::get_if<SplatsRendererOptions>(&options);
             splats != nullptr && !on_processor(splats->engine)) {
    splats->engine = SplatsEngine::processor;
    make_renderer = build_renderer_factory(options, scene, false, world.info.cameras, notices);
  }
  return [make_renderer = std::move(make_renderer)](const Camera& camera, const Workers& workers) {
    return make_renderer.make(camera, ColourFilters::none, workers);
  };
}

}  // namespace

void prepare_truth(const Scenario& scenario, const SceneFile& scene, const RendererFactory& make_renderer,
                   const Notices& notices, World& world) {
  const TruthOptions& truth = scenario.truth;
  const double duration_s = to_seconds(world.info.end - world.info.start);
  const RendererTraits traits = world.cameras.front().renderer->traits();
  check_optical_flow(truth, world.truth_clock, duration_s, traits);
  check_event_points(truth, traits);
  warn_of_much(scenario, duration_s, notices);

  world.truth_objects = truth.objects;
  EventPoints::MakeRenderer make_pixel_renderer;
  if (truth.event_points)
    make_pixel_renderer = for_single_pixels(make_renderer, scenario.renderer, scene, world, notices);
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    CameraChannel& camera = world.cameras[i];
    const Camera& model = world.info.cameras[i].model;
    if (truth.optical_flow)
      camera.optical_flow = std::make_unique<OpticalFlowFromDepth>(model, world.deforming, *world.workers);
    if (truth.event_points && !camera.event_sensors.empty()) {
      camera.event_points = std::make_unique<EventPoints>(model, make_pixel_renderer, view_at(world, i),
                                                          TimeSpan{world.info.start, world.info.end}, *world.workers);
    }
  }
}

}  // namespace esim::inline compose

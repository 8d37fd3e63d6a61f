#include "esim/dataset/generators/affine_sequences.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <utility>

#include "esim/backends/sprites/sprites_renderer.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/core/random.h"
#include "esim/dataset/collector.h"
#include "esim/dataset/files/checksum.h"
#include "esim/dataset/generators/image_folder.h"
#include "esim/motion/static.h"
#include "esim/scenario/conversion.h"
#include "esim/scene/images/dead_leaves.h"
#include "esim/sim/simulate.h"

namespace esim::inline dataset {
namespace {

/// The initial placement of an image under the sensor.
struct Framing {
  AffineStart start;
  Eigen::Vector2d pivot{0.5, 0.5};  ///< point of the image at the sensor's centre
};

/// A slightly rotated placement in which the image covers the sensor, unless a small image would be blurred.
Framing draw_framing(PixelSize sensor, const Texture& image, const AddressedRandom& random, std::uint32_t index) {
  constexpr double kMaxTurn_deg = 30, kMaxEnlarged = 1.5;
  const auto [turn, size] = random.uniforms(index, 1);
  const auto [u, v] = random.uniforms(index, 2);
  Framing framing;
  framing.start.rotation_deg = kMaxTurn_deg * (2 * turn - 1);
  const double angle = framing.start.rotation_deg * std::numbers::pi / 180;
  const double c = std::fabs(std::cos(angle)), s = std::fabs(std::sin(angle));

  // Width and height of the sensor in the image, at scale 1, and the scale at which they just fit.
  const Eigen::Vector2d seen(sensor.width * c + sensor.height * s, sensor.width * s + sensor.height * c);
  const Eigen::Vector2d extent(image.width(), image.height());
  const double min = seen.cwiseQuotient(extent).maxCoeff(), max = std::max(1.0, kMaxEnlarged * min);
  framing.start.scale = min * std::pow(max / min, size);
  const Eigen::Vector2d margin = 0.5 * seen.cwiseQuotient(extent) / framing.start.scale;
  framing.pivot = margin + (Eigen::Vector2d::Ones() - 2 * margin).cwiseProduct(Eigen::Vector2d(u, v));
  return framing;
}

VectorField affine_field(PixelSize size, const AffineFlow& map) {
  VectorField field{Image<float>(size.width, size.height), Image<float>(size.width, size.height)};
  const Eigen::Vector2d middle((size.width - 1) / 2.0, (size.height - 1) / 2.0);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector2d v = map.at(Eigen::Vector2d(x, y) - middle);
      field.x(x, y) = static_cast<float>(v.x());
      field.y(x, y) = static_cast<float>(v.y());
    }
  }
  return field;
}

/// The motion field, V = c' + A' A^-1 (pixel - c).
AffineFlow velocity(const SpritePlacement& at, PixelSize sensor) {
  const Eigen::Matrix2d gradient = at.A_rate * at.A.inverse();
  const Eigen::Vector2d middle((sensor.width - 1) / 2.0, (sensor.height - 1) / 2.0);
  return {gradient, at.centre_velocity + gradient * (middle - at.centre)};
}

/// A camera at rest that sees the sprites, without ground truth, on one thread.
World world_of(const AffineOptions& o, const std::vector<SensorOptions>& sensors, const SpriteScene& scene) {
  CameraOptions camera;
  camera.name = "cam0";
  camera.width = o.width;
  camera.height = o.height;
  camera.sampling = o.sampling;
  camera.event_cameras = sensors;
  Scenario scenario;
  scenario.cameras = {camera};
  scenario.truth.rate_hz = scenario.truth.pose_rate_hz = 0;
  Substitutes substitutes;
  substitutes.body = std::make_shared<const StaticTrajectory>(SE3{}, 0, to_ns(o.duration_s));
  substitutes.make_renderer = [&](const Camera& model, const Workers& workers) {
    return make_sprites_renderer(scene, model, workers);
  };
  const auto ignore = [](const std::string&) {};
  return build_world(scenario, substitutes, 1, {ignore, ignore});
}

void check(const AffineOptions& o) {
  const auto require = [](bool good, const std::string& problem) {
    if (!good) throw UserError(problem);
  };
  require(o.width >= 8 && o.height >= 8 && o.width <= 8192 && o.height <= 8192,
          fmt::format("sensor of {}x{} px: must be from 8x8 to 8192x8192 px", o.width, o.height));
  require(o.duration_s >= 1e-4 && o.duration_s <= 100,
          fmt::format("duration of {} s: must be from 0.0001 to 100 s", o.duration_s));
  require(o.contrast_threshold.low >= kMinContrastThreshold && o.contrast_threshold.high <= 100 &&
              o.contrast_threshold.low <= o.contrast_threshold.high,
          fmt::format("contrast thresholds from {} to {}: must increase, between {} and 100", o.contrast_threshold.low,
                      o.contrast_threshold.high, kMinContrastThreshold));
  require(o.flow_scale >= 1e-3 && o.flow_scale <= 1e3,
          fmt::format("flow scale of {}: must be from 0.001 to 1000", o.flow_scale));
  require(!o.event_camera.labels, "event_camera.labels: data sets have no labels of events; remove it");
  const MotionMix& mix = o.mix;
  require(std::min({mix.translation, mix.rotation, mix.scale, mix.shear}) >= 0 &&
              std::isfinite(mix.translation + mix.rotation + mix.scale + mix.shear) && mix.translation > 0,
          "motion mix: the strengths must be at least 0, and that of translation above 0");
}

}  // namespace

struct AffineSequences::Impl {
  std::optional<ImageFolder> images;
  MagnitudeHistogram strengths;

  ImageFolder::Picture picture(std::uint64_t seed, std::uint32_t index, std::uint32_t offset) const {
    if (images) return images->pick(std::uint64_t{index} + offset);
    auto light = std::make_shared<const Texture>(dead_leaves({}, seed, index), Wrap::clamp, Wrap::clamp);
    return {"dead leaves", std::move(light), {}};
  }
};

AffineSequences::AffineSequences(AffineOptions options) : options_(std::move(options)) {
  check(options_);
  auto impl = std::make_unique<Impl>();
  if (!options_.images.empty()) impl->images.emplace(options_.images);
  options_.magnitudes = options_.magnitudes.scaled(options_.flow_scale);
  impl->strengths = strengths_for(options_.magnitudes, options_.mix, {options_.width, options_.height});
  impl_ = std::move(impl);
}

AffineSequences::~AffineSequences() = default;

std::string AffineSequences::options() const {
  const AffineOptions& o = options_;
  nlohmann::ordered_json json{
      {"kind", "affine"},
      {"images", o.images.empty() ? "dead leaves" : checksum_text(impl_->images->fingerprint())},
      {"width", o.width},
      {"height", o.height},
      {"duration_s", o.duration_s},
      {"seed", o.seed},
      {"motion_field_at", kEnumNames<MotionFieldTime>[static_cast<std::size_t>(o.motion_field_at)]},
      {"contrast_threshold", {o.contrast_threshold.low, o.contrast_threshold.high}},
      {"mix", {o.mix.translation, o.mix.rotation, o.mix.scale, o.mix.shear}},
      {"sampling", write_sampling(o.sampling)},
      {"event_camera", write_event_camera(o.event_camera)},
      {"magnitudes", {{"edges_px", o.magnitudes.edges}, {"fractions", o.magnitudes.fractions}}}};
  if (o.sensors > 1) json["sensors"] = o.sensors;
  return json.dump();
}

SensorOptions AffineSequences::draw_sensor(std::uint32_t index) const {
  SensorOptions sensor{options_.event_camera};
  if (options_.sensors > 1) sensor.name = fmt::format("sensor{}", index % options_.sensors);
  const AddressedRandom random(options_.seed, Purpose::dataset_sensor);
  const auto words = random.bits(index);
  const auto [low, high] = options_.contrast_threshold;
  sensor.contrast_threshold = low + random.uniforms(index, 1)[0] * (high - low);
  sensor.contrast_threshold_on.reset();
  sensor.contrast_threshold_off.reset();
  sensor.seed = (std::uint64_t{words[0]} << 32) | words[1];
  return sensor;
}

std::vector<Sequence> AffineSequences::make_all(std::uint32_t rendering) const {
  const AffineOptions& o = options_;
  const PixelSize sensor{o.width, o.height};

  // The image and its motion. Strengths cover their distribution evenly.
  const AddressedRandom random(o.seed, Purpose::dataset_image);
  const auto all = random.bits(0xffffffffU);  // common to all sequences
  const ImageFolder::Picture picture = impl_->picture(o.seed, rendering, all[0]);
  const Framing framing = draw_framing(sensor, *picture.light, random, rendering);
  double turn = 0;
  const double u = std::modf(AddressedRandom::open_unit(all[1], all[2]) + std::numbers::phi * rendering, &turn);
  const AffineMotion motion =
      draw_motion(o.mix, sensor, framing.start, o.duration_s, impl_->strengths.quantile(u), o.seed, rendering);
  const SpriteMotion sprite_motion({motion.poses.begin(), motion.poses.end()}, SpriteInterpolation::spline);
  const Sprite sprite{picture.light, nullptr, SpriteUnits::pixel, SpriteBeyond::mirror, sprite_motion, framing.pivot};

  // The pixels.
  std::vector<SensorOptions> sensors;
  for (std::uint32_t k = 0; k < o.sensors; ++k) sensors.push_back(draw_sensor(rendering * o.sensors + k));
  World world = world_of(o, sensors, SpriteScene{{sprite}});

  std::vector<Sequence> sequences(o.sensors);
  Collector collector(sequences);
  simulate(world, collector, [](const Progress&) { return true; });

  // Ground truth, from the placements of the image.
  const auto lies = [&](TimeNs t) {
    return place(sprite_motion.at(t), SpriteUnits::pixel, {picture.light->width(), picture.light->height()}, sensor,
                 framing.pivot);
  };
  const TimeNs start = 0, end = world.info.end;
  Sequence truth;
  truth.motion_field_t = o.motion_field_at == MotionFieldTime::start ? start
                         : o.motion_field_at == MotionFieldTime::end ? end
                                                                     : end / 2;
  truth.motion_field = affine_field(sensor, velocity(lies(truth.motion_field_t), sensor));
  truth.optical_flow = affine_field(sensor, flow_between(lies(start), lies(end), sensor));
  Sample sample;
  for (const auto& [t, image] : {std::pair{start, &truth.first}, std::pair{end, &truth.last}}) {
    world.cameras[0].renderer->render(view(world, 0, t), sample);
    *image = sample.irradiance;
  }
  const auto pose = [](const SpritePose& k) {
    return nlohmann::ordered_json{{"t_s", k.t_s},
                                  {"position", {k.position.x(), k.position.y()}},
                                  {"rotation_deg", k.rotation_deg},
                                  {"scale", {k.scale.x(), k.scale.y()}},
                                  {"shear", k.shear}};
  };
  truth.passed_over = picture.passed_over;
  for (std::uint32_t k = 0; k < o.sensors; ++k) {
    Sequence sequence = truth;
    sequence.index = rendering * o.sensors + k;
    sequence.width = sequences[k].width, sequence.height = sequences[k].height;
    sequence.span = sequences[k].span;
    sequence.events = std::move(sequences[k].events);
    const nlohmann::ordered_json info{{"image", picture.name},
                                      {"motion_field_t", sequence.motion_field_t},
                                      {"contrast_threshold", sensors[k].contrast_threshold},
                                      {"optical_flow_rms_px", motion.optical_flow_rms_px},
                                      {"pivot", {framing.pivot.x(), framing.pivot.y()}},
                                      {"poses", {pose(motion.poses[0]), pose(motion.poses[1]), pose(motion.poses[2])}}};
    sequence.info = info.dump();
    sequences[k] = std::move(sequence);
  }
  return sequences;
}

}  // namespace esim::inline dataset

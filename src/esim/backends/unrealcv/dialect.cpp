#include "esim/backends/unrealcv/dialect.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "esim/backends/unrealcv/engine_image.h"
#include "esim/backends/unrealcv/unreal_pose.h"
#include "esim/core/engine_error.h"

namespace esim::inline backends::inline unrealcv {
namespace {

/// The largest 16-bit floating-point number, which is the depth of the sky.
constexpr float kNoDepth = 65504;

// Without exponents, which servers do not parse.
std::string location_text(const UnrealPose& pose) {
  const Eigen::Vector3d& p = pose.location_cm;
  return fmt::format("{:.6f} {:.6f} {:.6f}", p.x(), p.y(), p.z());
}

std::string rotation_text(const UnrealPose& pose) {
  return fmt::format("{:.8f} {:.8f} {:.8f}", pose.pitch_deg, pose.yaw_deg, pose.roll_deg);
}

bool offers(const EngineRequest& request) { return request.answer && is_npy(*request.answer); }

std::string shortened(const std::string& text) {
  constexpr std::size_t kMax = 120;
  std::string plain;
  for (const char c : text.substr(0, kMax)) plain += c >= ' ' && c < 127 ? c : '?';
  return text.size() > kMax ? plain + "..." : plain;
}

}  // namespace

Dialect::Dialect(const UnrealcvOptions& options, EngineSession& session, const EngineView& view, EngineState& state)
    : options_(options), light_(options.light), depth_(options.depth), mask_(options.mask) {
  learn_commands(session);
  if (!options.objects.empty()) learn_objects(session);
  EngineBatch settings = setting_commands(view, state);
  session.send(settings);
  session.wait_for(settings);
  require_done(settings);
  learn_images(session);
}

std::string Dialect::camera(const char* verb, const std::string& rest) const {
  return fmt::format("{} /camera/{}/{}", verb, options_.camera, rest);
}

void Dialect::learn_commands(EngineSession& session) {
  const EngineBatch answers =
      session.ask({camera("vget", "location"), camera("vget", "pose"), camera("vget", "horizontal_fieldofview"),
                   camera("vget", "fov"), camera("vget", "size")});
  if (answers[0].is_refused()) {
    fail(options_, fmt::format("the answer to '{}' is '{}'", answers[0].command, shortened(*answers[0].answer)),
         "change renderer.camera");
  }
  has_pose_ = !answers[1].is_refused();
  if (answers[2].is_refused() && answers[3].is_refused())
    fail(options_, "it has no command that changes the field of view", "use UnrealCV 0.3.10 or later");
  fov_command_ = answers[2].is_refused() ? "fov" : "horizontal_fieldofview";
  has_size_ = !answers[4].is_refused();
}

void Dialect::learn_images(EngineSession& session) {
  const EngineBatch answers = session.ask({
      camera("vget", light_ == EngineLight::automatic ? options_.light_image + " npy" : "location"),
      camera("vget", depth_ == EngineDepth::automatic ? "plane_depth npy" : "location"),
      camera("vget", masks() && mask_ == EngineMask::automatic ? "object_mask npy" : "location"),
  });
  if (light_ == EngineLight::automatic) light_ = offers(answers[0]) ? EngineLight::npy : EngineLight::png;
  if (depth_ == EngineDepth::automatic) {
    const EngineDepth by_version = has_size_ ? EngineDepth::planar_centimetres : EngineDepth::ray_metres;
    depth_ = offers(answers[1]) ? EngineDepth::plane_depth : by_version;
  }
  if (masks() && mask_ == EngineMask::automatic) mask_ = offers(answers[2]) ? EngineMask::npy : EngineMask::png;
}

void Dialect::learn_objects(EngineSession& session) {
  std::vector<std::string> commands;
  for (const std::string& name : options_.objects)
    commands.push_back(fmt::format("vget /object/{}/{}", name, masks() ? "color" : "location"));
  commands.emplace_back("vget /objects");
  const EngineBatch answers = session.ask(std::move(commands));
  for (std::size_t i = 0; i < options_.objects.size(); ++i) {
    if (answers[i].is_refused()) {
      fail(options_, fmt::format("the answer to '{}' is '{}'", answers[i].command, shortened(*answers[i].answer)),
           fmt::format("use the name of an object that exists: {}", shortened(answers.back().answer.value_or(""))));
    }
    if (!masks()) continue;
    try {
      mask_codes_.push_back(colour_code(*answers[i].answer));
    } catch (const EngineError&) {
      fail(options_,
           fmt::format("the answer to '{}' is '{}', which is not a colour", answers[i].command,
                       shortened(*answers[i].answer)),
           "set renderer.object_mask: none (moving objects are then static in the motion field)");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (mask_codes_[j] != mask_codes_[i]) continue;
      fail(options_, fmt::format("objects {} and {} have the same colour", options_.objects[j], options_.objects[i]),
           "give them different colours");
    }
  }
}

EngineBatch Dialect::setting_commands(const EngineView& view, EngineState& state) const {
  EngineBatch batch;
  const auto add = [&](std::string command) { batch.push_back({std::move(command)}); };
  if (state.width != view.width || state.height != view.height) {
    add(has_size_ ? camera("vset", fmt::format("size {} {}", view.width, view.height))
                  : fmt::format("vrun r.setres {}x{}", view.width, view.height));
    state.width = view.width, state.height = view.height;
  }
  const double fov_deg = 2 * std::atan2(0.5 * view.width, view.focal_px) * 180 / std::numbers::pi;
  if (state.horizontal_fov_deg != fov_deg) {
    add(camera("vset", fmt::format("{} {:.8f}", fov_command_, fov_deg)));
    state.horizontal_fov_deg = fov_deg;
  }
  if (state.samples != view.samples) {
    add(fmt::format("vrun esim.samples {}", view.samples));
    state.samples = view.samples;
  }
  const UnrealPose pose = unreal_camera_pose_of(view.T_world_camera);
  if (has_pose_) {
    add(camera("vset", fmt::format("pose {} {}", location_text(pose), rotation_text(pose))));
  } else {
    add(camera("vset", "location " + location_text(pose)));
    add(camera("vset", "rotation " + rotation_text(pose)));
  }
  for (std::size_t i = 0; i < view.objects.size(); ++i) {
    const UnrealPose there = unreal_pose_of(view.objects[i]);
    add(fmt::format("vset /object/{}/location {}", options_.objects[i], location_text(there)));
    add(fmt::format("vset /object/{}/rotation {}", options_.objects[i], rotation_text(there)));
  }
  return batch;
}

/// The commands for light, depth and, if they are needed, masks.
std::vector<std::string> Dialect::image_commands() const {
  std::vector<std::string> commands = {
      camera("vget", options_.light_image + (light_ == EngineLight::npy ? " npy" : " png")),
      camera("vget", depth_ == EngineDepth::plane_depth ? "plane_depth npy" : "depth npy")};
  if (masks()) commands.push_back(camera("vget", mask_ == EngineMask::npy ? "object_mask npy" : "object_mask png"));
  return commands;
}

EngineBatch Dialect::commands_for(const EngineView& view, EngineState& state) const {
  EngineBatch batch = setting_commands(view, state);
  const std::vector<std::string> images = image_commands();
  for (int i = 0; i < options_.lag_frames; ++i) batch.push_back({images[0]});
  for (const std::string& command : images) batch.push_back({command});
  return batch;
}

void Dialect::require_done(std::span<const EngineRequest> batch) const {
  for (const EngineRequest& request : batch) {
    if (!request.is_refused()) continue;
    fail(options_, fmt::format("the answer to '{}' is '{}'", request.command, shortened(*request.answer)),
         "see the log of the server");
  }
}

EngineRequest Dialect::take_light(EngineBatch& batch) const {
  const std::size_t light = batch.size() - images();
  require_done(std::span(batch).first(light + 1));
  return std::exchange(batch[light], {batch[light].command, ""});
}

/// Adds the command to errors.
template <typename Decode>
void Dialect::decode(const EngineRequest& answered, const Decode& decode) const {
  try {
    decode(*answered.answer);
  } catch (const EngineError& error) {
    fail(options_, fmt::format("the answer to '{}' {}", answered.command, error.what()),
         "change renderer.light, renderer.depth or renderer.object_mask, which choose the commands for images");
  }
}

void Dialect::decode_light(const EngineRequest& answered, const EngineView& view, PinholeImage& image) const {
  decode(answered, [&](const std::string& body) {
    esim::decode_light(body, {view.width, view.height}, image.irradiance);
  });
  if (options_.exposure == 1) return;
  for (float& light : image.irradiance.pixels()) light *= static_cast<float>(options_.exposure);
}

void Dialect::decode_geometry(const EngineBatch& answered, const EngineView& view, PinholeImage& image) const {
  require_done(answered);
  const ImageExtent extent{view.width, view.height};
  const std::size_t depth = answered.size() - images() + 1;
  decode(answered[depth], [&](const std::string& body) { decode_depth(body, extent, image.depth); });
  if (masks()) {
    decode(answered[depth + 1], [&](const std::string& body) { decode_mask(body, extent, mask_codes_, image.object); });
  } else if (!options_.objects.empty() && image.object.bounds() != image.depth.bounds()) {
    image.object = Image<std::uint16_t>(view.width, view.height);
  }
  convert_depth(view, image.depth);
}

void Dialect::convert_depth(const EngineView& view, Image<float>& depth) const {
  const bool centimetres = depth_ == EngineDepth::ray_centimetres || depth_ == EngineDepth::planar_centimetres;
  const bool of_ray = depth_ == EngineDepth::ray_metres || depth_ == EngineDepth::ray_centimetres;
  const float unit = centimetres ? 0.01F : 1.0F;
  for (int y = 0; y < view.height; ++y) {
    const auto by = static_cast<float>((y - 0.5 * (view.height - 1)) / view.focal_px);
    float* const row = depth.row(y);
    for (int x = 0; x < view.width; ++x) {
      const auto bx = static_cast<float>((x - 0.5 * (view.width - 1)) / view.focal_px);
      const bool nothing = row[x] >= kNoDepth || row[x] <= 0;
      const float per_length = of_ray ? unit / std::sqrt(1 + bx * bx + by * by) : unit;
      row[x] = nothing ? std::numeric_limits<float>::infinity() : per_length * row[x];
    }
  }
}

}  // namespace esim::inline backends::inline unrealcv

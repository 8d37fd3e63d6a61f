#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esim/backends/unrealcv/session.h"
#include "esim/geometry/se3.h"
#include "esim/render/pinhole_lookup.h"

namespace esim {

/// What a program is asked to show: a pinhole image.
struct EngineView {
  int width = 0, height = 0;
  double focal_px = 0;  ///< the principal point is in the middle
  SE3 T_world_camera;
  std::vector<SE3> objects{};  ///< T_world_object
  int samples = 0;             ///< per pixel; 0: as many as the program likes
};

/// What a program was last told of its camera; nothing after connecting.
struct EngineState {
  int width = 0, height = 0;
  double horizontal_fov_deg = 0;
  int samples = 0;
};

/// The commands that one server understands, among those that versions of UnrealCV differ in.
class Dialect {
 public:
  /// Finds out by asking, images included, for which it sets the state that a view wants; `state` is that, then. Throws
  /// ConnectionLost and EngineError.
  Dialect(const UnrealcvOptions& options, EngineSession& session, const EngineView& view, EngineState& state);

  /// What to send so that it shows a view. Then `state` is what it was told.
  EngineBatch commands_for(const EngineView& view, EngineState& state) const;

  /// How many of the last answers to these commands are images. The first of them is light.
  std::size_t images() const { return masks() ? 3 : 2; }

  /// Takes the answer that is light out of a batch in which no more need be answered. Throws EngineError naming a
  /// command that failed.
  EngineRequest take_light(EngineBatch& batch) const;

  /// E in that answer. Throws OtherSize, and EngineError naming the command.
  void decode_light(const EngineRequest& answered, const EngineView& view, PinholeImage& image) const;

  /// Z in metres, and the object where any are known, in the answers to all commands. Throws OtherSize, and EngineError
  /// naming the command that failed.
  void decode_geometry(const EngineBatch& answered, const EngineView& view, PinholeImage& image) const;

 private:
  void learn_commands(EngineSession& session);
  void learn_images(EngineSession& session);
  void learn_objects(EngineSession& session);
  void require_done(std::span<const EngineRequest> batch) const;
  template <typename Decode>
  void decode(const EngineRequest& answered, const Decode& decode) const;
  std::string camera(const char* verb, const std::string& rest) const;
  EngineBatch setting_commands(const EngineView& view, EngineState& state) const;
  std::vector<std::string> image_commands() const;
  bool masks() const { return !options_.objects.empty() && mask_ != EngineMask::none; }
  void convert_depth(const EngineView& view, Image<float>& depth) const;

  const UnrealcvOptions& options_;
  bool has_pose_ = false, has_size_ = false;
  std::string fov_command_;
  EngineLight light_;
  EngineDepth depth_;
  EngineMask mask_;
  std::vector<std::uint32_t> mask_codes_;  // of the objects
};

}  // namespace esim

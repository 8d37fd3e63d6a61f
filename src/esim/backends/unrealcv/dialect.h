#pragma once

#include <cstdint>
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

  /// The image in the answers to these commands: E, Z in metres, and the object where any are known. Throws OtherSize,
  /// and EngineError naming the command that failed.
  void decode(const EngineBatch& answered, const EngineView& view, PinholeImage& image) const;

 private:
  void learn_commands(EngineSession& session);
  void learn_images(EngineSession& session);
  void learn_objects(EngineSession& session);
  void require_done(const EngineBatch& batch) const;
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

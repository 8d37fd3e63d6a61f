#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esim/backends/unrealcv/session.h"
#include "esim/geometry/se3.h"
#include "esim/render/pinhole_lookup.h"

// Private to backends/unrealcv.
namespace esim::inline backends::inline unrealcv {

/// A pinhole image that is requested from a program.
struct EngineView {
  int width = 0, height = 0;
  double focal_px = 0;  ///< the principal point is in the middle
  SE3 T_world_camera;
  std::vector<SE3> objects{};  ///< T_world_object
  int samples = 0;             ///< per pixel; 0: the program's default
};

/// The last settings of a program's camera; unset after connecting.
struct EngineState {
  int width = 0, height = 0;
  double horizontal_fov_deg = 0;
  int samples = 0;
};

/// The commands of one server, where versions of UnrealCV differ.
class Dialect {
 public:
  /// Determines the commands by queries, including images, for which it sets the camera as a view requires and updates
  /// `state`. Throws ConnectionLost and EngineError.
  Dialect(const UnrealcvOptions& options, EngineSession& session, const EngineView& view, EngineState& state);

  /// The commands that request a view. Updates `state` accordingly.
  EngineBatch commands_for(const EngineView& view, EngineState& state) const;

  /// Number of images, which are the last answers to these commands. The first image is light.
  std::size_t images() const { return masks() ? 3 : 2; }

  /// Moves the answer with light out of a batch; later answers may still be missing. Throws EngineError, which names
  /// the command, if one failed.
  EngineRequest take_light(EngineBatch& batch) const;

  /// Decodes E from that answer. Throws OtherSize, and EngineError, which names the command.
  void decode_light(const EngineRequest& answered, const EngineView& view, PinholeImage& image) const;

  /// Decodes Z in metres, and the objects if there are any, from the answers to all commands. Throws OtherSize, and
  /// EngineError, which names the command that failed.
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

}  // namespace esim::inline backends::inline unrealcv

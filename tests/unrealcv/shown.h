#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "esim/backends/unrealcv/unrealcv_renderer.h"
#include "esim/core/engine_error.h"
#include "render/scenes.h"
#include "support/errors.h"
#include "support/unrealcv_server.h"

namespace esim::test {

/// Light and depth that differ from pixel to pixel, of any size: 0.1 to 0.9 along the diagonal, 2 m to 3 m downwards.
inline PinholeImage show_ramp(const ServedView& view) {
  PinholeImage image{Image<float>(view.width, view.height), Image<float>(view.width, view.height), {}};
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(view.width);
      const float v = static_cast<float>(y) / static_cast<float>(view.height);
      image.irradiance(x, y) = 0.1F + 0.4F * (u + v);
      image.depth(x, y) = 2.0F + v;
    }
  }
  return image;
}

/// A client of a server.
inline UnrealcvOptions options_for(const UnrealcvServer& server, double timeout_s = 5) {
  UnrealcvOptions options;
  options.port = server.port();
  options.timeout_s = timeout_s;
  return options;
}

inline std::unique_ptr<Renderer> renderer_for(const UnrealcvOptions& options, const Camera& camera) {
  return make_unrealcv_renderer(make_unrealcv_client(options), camera, two_threads());
}

/// A small ideal camera.
inline Camera small_camera() { return Camera::from_fov(32, 24, 1.2); }

inline bool has_command(const std::vector<std::string>& commands, const std::string& command) {
  return std::find(commands.begin(), commands.end(), command) != commands.end();
}

}  // namespace esim::test

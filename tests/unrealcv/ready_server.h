#pragma once

#include "unrealcv/shown.h"

namespace esim::test {

/// A server with prepared images for a camera's renderer, so that all time of a frame is spent in the protocol.
/// Light has detail and noise, like a rendered image.
inline std::unique_ptr<UnrealcvServer> ready_server(const Camera& camera, bool png) {
  const PixelRays rays(camera);
  const PinholeView view = pinhole_view(camera, rays, Pinhole::centred);
  auto server = std::make_unique<UnrealcvServer>(show_ramp, std::vector<std::string>{},
                                                 UnrealcvServer::Version{.npy_light = !png});
  Image<float> light(view.width, view.height);
  std::uint32_t noise = 1;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      noise = 1664525 * noise + 1013904223;
      const double wave = std::sin(0.07 * x) * std::cos(0.05 * y) + 0.5 * std::sin(0.31 * x + 0.2 * y);
      light(x, y) = static_cast<float>(0.4 + 0.2 * wave + 0.02 * (noise >> 8) / double{1 << 24});
    }
  }
  const PinholeImage image = show_ramp({view.width, view.height});
  server->ready["plane_depth npy"] = UnrealcvServer::npy("<f4", image.depth);
  server->ready[png ? "lit png" : "lit npy"] = png ? UnrealcvServer::lit_png(light) : UnrealcvServer::npy("<f4", light);
  return server;
}

}  // namespace esim::test

#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "esim/render/renderer.h"

namespace esim::bench {

/// The whole image for n = 1; every n-th of its tiles of 32 x 20 pixels otherwise.
inline std::vector<Tile> every_nth_tile(const Camera& camera, int n) {
  if (n == 1) return {{0, 0, camera.width, camera.height}};
  std::vector<Tile> tiles;
  int i = 0;
  for (int y = 0; y < camera.height; y += 20) {
    for (int x = 0; x < camera.width; x += 32) {
      if (i++ % n == n / 2) tiles.push_back({x, y, std::min(32, camera.width - x), std::min(20, camera.height - y)});
    }
  }
  return tiles;
}

/// Renders every n-th tile of the camera's image (see every_nth_tile), one request after the other. The camera goes
/// through the same hundred positions, 0.1 mm apart, again and again. Counter: ns/px.
inline void render_frames(benchmark::State& state, Renderer& renderer, const Camera& camera, const Kinematics& start,
                          int nth_tile = 1, const std::vector<Kinematics>& objects = {}) {
  const std::vector<Tile> tiles = every_nth_tile(camera, nth_tile);
  Kinematics pose = start;
  Sample sample;
  renderer.render({0, pose, tiles, objects}, sample);  // drivers prepare much at the first one
  int step = 0;
  for (auto _ : state) {
    pose.T_world_body.translation.y() = start.T_world_body.translation.y() + 1e-4 * step;
    step = (step + 1) % 100;
    renderer.render({0, pose, tiles, objects}, sample);
    benchmark::DoNotOptimize(sample.irradiance.data());
  }
  double pixels = 0;
  for (const Tile& tile : tiles) pixels += static_cast<double>(tile.area() * state.iterations());
  state.counters["ns/px"] =
      benchmark::Counter(pixels * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

}  // namespace esim::bench

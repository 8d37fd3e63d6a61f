// The irradiance that the first camera of a scenario sees at the start of its trajectory, as float32, row by row:
//   render_irradiance SCENARIO FILE

#include <fmt/format.h>

#include <cstdio>
#include <fstream>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "esim/sim/world.h"

int main(int count, char** arguments) {
  try {
    if (count != 3) throw esim::UserError("usage: render_irradiance SCENARIO FILE");
    const auto warn = [](const std::string& text) { fmt::print(stderr, "{}\n", text); };
    const auto ignore = [](const std::string&) {};
    const esim::World world = esim::build_world(esim::read_scenario(arguments[1]), 0, {warn, ignore});
    const esim::Camera& camera = world.info.cameras[0].model;
    esim::RenderRequest request = esim::view_at(world, 0)(world.info.start);
    request.tiles = {{0, 0, camera.width, camera.height}};
    esim::Sample sample;
    world.cameras[0].renderer->render(request, sample);
    const auto pixels = sample.irradiance.pixels();
    std::ofstream file(arguments[2], std::ios::binary);
    file.write(reinterpret_cast<const char*>(pixels.data()), static_cast<std::streamsize>(pixels.size_bytes()));
    if (!file) throw esim::UserError(fmt::format("{}: cannot be written", arguments[2]));
  } catch (const esim::UserError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}

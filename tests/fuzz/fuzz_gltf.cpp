// Reads arbitrary bytes from libFuzzer as a glTF file (.glb), and evaluates what deforms: the result is a scene or a
// UserError, in bounded memory and time.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "esim/core/error.h"
#include "esim/scene/scene_file.h"
#include "named_memory.h"

namespace {

void evaluate(const esim::SceneObject& object) {
  if (!object.deforms()) return;
  esim::DeformedVertices vertices;
  for (const esim::TimeNs t : {object.deformation->span().start, object.deformation->span().end}) {
    object.deformation->evaluate(t, vertices);
    if (vertices.positions.size() != object.mesh.vertices.size() ||
        vertices.velocities.size() != object.mesh.vertices.size() ||
        vertices.normals.size() != object.mesh.normals.size())
      std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const NamedMemory file("fuzz.glb");
  file.write(data, size);
  const auto ignore = [](const std::string&) {};
  try {
    for (const esim::SceneObject& object : esim::load_scene_file(file.path(), ignore).scene.objects) evaluate(object);
    evaluate(esim::load_scene_object(file.path(), ignore, esim::SceneLook::luminance));
  } catch (const esim::UserError&) {  // what a damaged file is meant to be
  }
  return 0;
}

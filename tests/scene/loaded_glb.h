#pragma once

#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/scene/scene_file.h"
#include "glb_writer.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim::test {

/// A GLB file as a scene, with the warnings.
struct Loaded {
  SceneFile file;
  std::vector<std::string> warnings;

  const Mesh& mesh() const { return file.scene.objects.at(0).mesh; }
};

inline Loaded load(const std::string& bytes) {
  const TemporaryDirectory folder;
  Loaded loaded;
  loaded.file = load_scene_file(folder.write("scene.glb", bytes),
                                [&](const std::string& text) { loaded.warnings.push_back(text); });
  return loaded;
}

inline Loaded load(const GlbWriter& glb) { return load(glb.bytes()); }

/// The message of the UserError with which it is refused.
inline std::string refusal(const GlbWriter& glb) {
  return message_of<UserError>([&] { load(glb); });
}

}  // namespace esim::test

// Reads arbitrary bytes from libFuzzer as a glTF file (.glb), and evaluates what deforms: the result is a scene or a
// UserError, in bounded memory and time.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "esim/core/error.h"
#include "esim/scene/scene_file.h"

namespace {

namespace fs = std::filesystem;

/// A file in memory with a name that ends with .glb.
class NamedMemory {
 public:
  NamedMemory() : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    std::string name = (fs::temp_directory_path() / "esim-fuzz-XXXXXX").string();
    if (descriptor_ < 0 || ::mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
    fs::create_symlink("/proc/self/fd/" + std::to_string(descriptor_), path());
  }
  ~NamedMemory() {
    fs::remove_all(folder_);
    ::close(descriptor_);
  }
  NamedMemory(const NamedMemory&) = delete;
  NamedMemory& operator=(const NamedMemory&) = delete;

  void write(const std::uint8_t* data, std::size_t size) const {
    if (::ftruncate(descriptor_, 0) != 0 || ::pwrite(descriptor_, data, size, 0) != static_cast<ssize_t>(size))
      std::abort();
  }
  fs::path path() const { return folder_ / "fuzz.glb"; }

 private:
  int descriptor_;
  fs::path folder_;
};

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
  static const NamedMemory file;
  file.write(data, size);
  const auto ignore = [](const std::string&) {};
  try {
    for (const esim::SceneObject& object : esim::load_scene_file(file.path(), ignore).scene.objects) evaluate(object);
    evaluate(esim::load_scene_object(file.path(), ignore, esim::SceneLook::luminance));
  } catch (const esim::UserError&) {  // what a damaged file is meant to be
  }
  return 0;
}

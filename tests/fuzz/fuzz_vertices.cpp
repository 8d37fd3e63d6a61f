// Reads arbitrary bytes from libFuzzer as the vertices of a triangle over time (.pc2, .mdd), and as numbered meshes
// (.obj, .ply), and evaluates them: the result is finite vertices in their bounds or a UserError, in bounded memory and
// time.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>

#include "esim/core/error.h"
#include "esim/scene/deformation/cached_deformation.h"
#include "esim/scene/vertices/vertex_file.h"
#include "named_memory.h"

namespace {

void check(const esim::CachedDeformation& deformation, esim::TimeNs t) {
  esim::DeformedVertices vertices;
  deformation.evaluate(t, vertices);
  const Eigen::AlignedBox3f box = deformation.bounds(t);
  for (std::size_t i = 0; i < vertices.positions.size(); ++i) {
    if (!vertices.velocities[i].allFinite() || !box.contains(vertices.positions[i])) std::abort();
  }
}

void read(const esim::VertexFile& file, const std::filesystem::path& mesh) {
  try {
    esim::VertexFrames frames = esim::read_vertex_frames(file, mesh);
    if (frames.times_s.size() * frames.vertices_per_frame() != frames.positions.size()) std::abort();
    std::vector<std::uint32_t> numbers(frames.vertices_per_frame());
    std::iota(numbers.begin(), numbers.end(), 0U);
    const esim::CachedDeformation deformation(esim::VertexSpline(std::move(frames)), std::move(numbers),
                                              esim::ShadingNormals(esim::Mesh{}));
    const esim::TimeSpan span = deformation.span();
    constexpr esim::TimeNs kLooks = 7;
    for (esim::TimeNs i = 0; i <= kLooks; ++i) check(deformation, span.start + (span.end - span.start) / kLooks * i);
  } catch (const esim::UserError&) {  // what a damaged file is meant to be
  }
}

/// A triangle in a folder of its own.
class Triangle {
 public:
  Triangle() : memory_("triangle.obj") {
    const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    memory_.write(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  }
  const std::filesystem::path& path() const { return memory_.path(); }

 private:
  NamedMemory memory_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Triangle triangle;
  static const NamedMemory pc2("fuzz.pc2"), mdd("fuzz.mdd"), obj("fuzz_1.obj"), ply("fuzz_1.ply");
  for (const NamedMemory* const file : {&pc2, &mdd, &obj, &ply}) file->write(data, size);
  read({pc2.path(), 24.0}, triangle.path());
  read({mdd.path()}, triangle.path());
  read({obj.path().parent_path() / "fuzz_#.obj", 24.0}, obj.path());
  read({ply.path().parent_path() / "fuzz_#.ply", 24.0}, ply.path());
  return 0;
}

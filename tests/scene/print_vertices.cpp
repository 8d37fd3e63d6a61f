// Writes the vertices of a scene's objects in the world at given times, for tests that compare them with other
// programs:
//
//   print_vertices [--vertices FILE RATE_HZ AXES] SCENE TIME_S ...
//
// With --vertices, they follow those of a file (see VertexFile); RATE_HZ is 0 for files with times.
// For each object a line "NAME VERTICES", and on standard output as float: per time, the positions and the velocities.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/scene/scene_file.h"
#include "esim/scene/vertices/vertex_file.h"

namespace esim {
namespace {

/// The vertices of an object in its own frame, which rests in the world.
DeformedVertices vertices_of(const SceneObject& object, TimeNs t) {
  DeformedVertices vertices;
  if (object.deforms()) {
    object.deformation->evaluate(t, vertices);
  } else {
    vertices.positions = object.mesh.vertices;
    vertices.velocities.assign(vertices.positions.size(), Eigen::Vector3f::Zero());
  }
  return vertices;
}

void print(const std::vector<Eigen::Vector3f>& vectors) {
  std::fwrite(vectors.data(), sizeof(Eigen::Vector3f), vectors.size(), stdout);
}

void print(const SceneObject& object, const std::vector<double>& times_s) {
  std::fprintf(stderr, "%s %zu\n", object.name.c_str(), object.mesh.vertices.size());
  for (const double t_s : times_s) {
    const DeformedVertices vertices = vertices_of(object, to_ns(t_s));
    print(vertices.positions);
    print(vertices.velocities);
  }
}

void warn(const std::string& warning) { std::fprintf(stderr, "warning: %s\n", warning.c_str()); }

int print_all(const std::string& file, const std::vector<double>& times_s) {
  const SceneFile scene = load_scene_file(file, warn);
  for (const SceneMotion& motion : scene.motions) {
    if (motion.size() > 1) return std::fprintf(stderr, "print_vertices: an object moves\n"), 1;
  }
  for (const SceneObject& object : scene.scene.objects) print(object, times_s);
  return 0;
}

VertexFile vertex_file(const std::string& file, const std::string& rate_hz, const std::string& axes) {
  VertexFile vertices{file};
  if (rate_hz != "0") vertices.rate_hz = std::atof(rate_hz.c_str());
  if (axes == "y_up") vertices.axes = VertexAxes::y_up;
  if (axes == "left_handed") vertices.axes = VertexAxes::left_handed;
  return vertices;
}

}  // namespace
}  // namespace esim

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  std::vector<std::string> cache;
  constexpr std::ptrdiff_t kCacheWords = 4;
  if (words.size() > kCacheWords && words[0] == "--vertices") {
    cache.assign(words.begin() + 1, words.begin() + kCacheWords);
    words.erase(words.begin(), words.begin() + kCacheWords);
  }
  if (words.size() < 2)
    return std::fprintf(stderr, "usage: print_vertices [--vertices FILE RATE_HZ AXES] SCENE TIME_S ...\n"), 2;
  std::vector<double> times_s;
  for (std::size_t i = 1; i < words.size(); ++i) times_s.push_back(std::atof(words[i].c_str()));
  try {
    if (cache.empty()) return esim::print_all(words[0], times_s);
    const esim::VertexFile vertices = esim::vertex_file(cache[0], cache[1], cache[2]);
    esim::print(esim::load_object_with_vertices(words[0], vertices, esim::warn, esim::SceneLook::luminance), times_s);
    return 0;
  } catch (const esim::UserError& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 1;
  }
}

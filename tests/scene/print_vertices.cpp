// Writes the vertices of a scene's objects in the world at given times, for tests that compare them with other
// programs:
//
//   print_vertices SCENE TIME_S ...
//
// For each object a line "NAME VERTICES", and on standard output as float: per time, the positions and the velocities.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/scene/scene_file.h"

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

int print_all(const std::string& file, const std::vector<double>& times_s) {
  const SceneFile scene =
      load_scene_file(file, [](const std::string& warning) { std::fprintf(stderr, "warning: %s\n", warning.c_str()); });
  for (const SceneMotion& motion : scene.motions) {
    if (motion.size() > 1) return std::fprintf(stderr, "print_vertices: an object moves\n"), 1;
  }
  for (const SceneObject& object : scene.scene.objects) {
    std::fprintf(stderr, "%s %zu\n", object.name.c_str(), object.mesh.vertices.size());
    for (const double t_s : times_s) {
      const DeformedVertices vertices = vertices_of(object, to_ns(t_s));
      print(vertices.positions);
      print(vertices.velocities);
    }
  }
  return 0;
}

}  // namespace
}  // namespace esim

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: print_vertices SCENE TIME_S ...\n"), 2;
  std::vector<double> times_s;
  for (int i = 2; i < argc; ++i) times_s.push_back(std::atof(argv[i]));
  try {
    return esim::print_all(argv[1], times_s);
  } catch (const esim::UserError& error) {
    return std::fprintf(stderr, "%s\n", error.what()), 1;
  }
}

#include "esim/scene/vertices/numbered_mesh.h"

#include <fmt/format.h>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/scene/import/scene_graph.h"
#include "esim/scene/vertices/mesh_formats.h"

namespace esim::inline scene {

NumberedMesh read_numbered_mesh(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) fail_vertices(file, "no such file");
  const std::string format = lower_extension(file);
  if (format != ".obj" && format != ".ply")
    fail_vertices(file,
                  "must be an OBJ or PLY file, since other formats do not number the vertices of a mesh; export it");
  NumberedMesh mesh = format == ".obj" ? read_obj_numbers(file) : read_ply_numbers(file);
  if (mesh.vertices.empty()) fail_vertices(file, "has no vertices; export a mesh");
  if (mesh.vertices.size() > kMaxSceneVertices)
    fail_vertices(file, fmt::format("has more than {} vertices; simplify the mesh", kMaxSceneVertices));
  return mesh;
}

void check_vertex(const std::filesystem::path& file, std::size_t number, const Eigen::Vector3f& vertex,
                  const std::string& where) {
  constexpr float kMaxCoordinate = 1e9F;
  if (vertex.allFinite() && vertex.cwiseAbs().maxCoeff() <= kMaxCoordinate) return;
  fail_vertices(file, fmt::format("vertex {}{} is at ({}, {}, {}); coordinates must be finite and at most 1e9, so "
                                  "export it again",
                                  number, where, vertex[0], vertex[1], vertex[2]));
}

void fail_vertices(const std::filesystem::path& file, const std::string& reason) {
  throw UserError(fmt::format("vertices {}: {}", file.string(), reason));
}

}  // namespace esim::inline scene

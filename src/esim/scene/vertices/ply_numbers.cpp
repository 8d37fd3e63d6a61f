#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/scene/import/scene_graph.h"
#include "esim/scene/splats/ply_file.h"
#include "esim/scene/vertices/mesh_formats.h"

namespace esim::inline scene {

NumberedMesh read_ply_numbers(const std::filesystem::path& file) {
  const PlyHeader header = read_ply_header(file);
  if (header.elements.empty() || header.elements.front().name != "vertex")
    fail_vertices(file, "its first element must be 'vertex'; export it again, for example with Blender");
  const PlyElement& element = header.elements.front();
  if (element.count > kMaxSceneVertices)
    fail_vertices(file, fmt::format("has more than {} vertices; simplify the mesh", kMaxSceneVertices));
  const bool lists = std::any_of(element.properties.begin(), element.properties.end(),
                                 [](const PlyProperty& property) { return property.list; });
  if (lists || !element.has("x") || !element.has("y") || !element.has("z"))
    fail_vertices(file, "its vertices must have x, y and z, and no lists; export it again, for example with Blender");
  PlyRows rows(file, header, element, {"x", "y", "z"});
  NumberedMesh mesh;
  mesh.vertices.reserve(static_cast<std::size_t>(element.count));
  for (std::uint64_t i = 0; i < element.count; ++i) {
    const std::vector<double>& row = rows.next();
    mesh.vertices.emplace_back(static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2]));
    check_vertex(file, mesh.vertices.size() - 1, mesh.vertices.back());
  }
  InputFile behind(file);
  behind.seek(rows.offset());
  mesh.faces.resize(static_cast<std::size_t>(behind.size() - behind.offset()));
  behind.read_into(mesh.faces);
  return mesh;
}

}  // namespace esim::inline scene

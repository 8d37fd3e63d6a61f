#include "esim/scene/vertices/vertex_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/scene/deformation/cached_deformation.h"
#include "esim/scene/import/flatten.h"
#include "esim/scene/vertices/frame_readers.h"

namespace esim::inline scene {
namespace {

/// A position in the axes of the mesh.
Eigen::Vector3f turned(const Eigen::Vector3f& v, VertexAxes axes) {
  switch (axes) {
    case VertexAxes::same:
      return v;
    case VertexAxes::y_up:
      return {v[0], -v[2], v[1]};
    case VertexAxes::left_handed:
      return {v[0], v[2], v[1]};
  }
  return v;
}

bool is_sequence(const VertexFile& vertices) {
  const std::string format = lower_extension(vertices.file);
  return format == ".obj" || format == ".ply";
}

/// The frames in the axes of their file.
VertexFrames frames_of(const VertexFile& vertices, const std::filesystem::path& mesh_file, const NumberedMesh& mesh) {
  if (is_sequence(vertices)) return read_mesh_sequence(vertices, mesh_file, mesh);
  const std::string format = lower_extension(vertices.file);
  if (format != ".pc2" && format != ".mdd")
    fail_vertices(vertices.file, "must be a point cache, .pc2 or .mdd, or numbered meshes, as cloth_####.obj or .ply");
  std::error_code error;
  if (!std::filesystem::is_regular_file(vertices.file, error)) fail_vertices(vertices.file, "no such file");
  return format == ".pc2" ? read_pc2(vertices, mesh.vertices.size()) : read_mdd(vertices, mesh.vertices.size());
}

/// Warns if a frame is where the mesh is, but in other axes than these. Its axes are those of the file.
void check_axes(const Eigen::Vector3f* frame, const NumberedMesh& mesh, const VertexFile& vertices,
                const WarningHandler& warn) {
  float size = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices) size = std::max(size, vertex.cwiseAbs().maxCoeff());
  const auto agrees = [&](VertexAxes axes) {
    constexpr float kTolerance = 1e-4F;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      if (!((turned(frame[i], axes) - mesh.vertices[i]).cwiseAbs().maxCoeff() <= kTolerance * size)) return false;
    }
    return true;
  };
  if (agrees(vertices.axes)) return;
  constexpr std::array<std::pair<VertexAxes, const char*>, 3> kAxes = {
      {{VertexAxes::same, "same"}, {VertexAxes::y_up, "y_up"}, {VertexAxes::left_handed, "left_handed"}}};
  for (const auto& [axes, name] : kAxes) {
    if (!agrees(axes)) continue;
    return warn(fmt::format("vertices {}: the first frame is the mesh only if axes is {}; set it",
                            vertices.file.filename().string(), name));
  }
}

/// Joins the vertices of a mesh with the same number and the same normal.
void join(Mesh& mesh, std::vector<std::uint32_t>& numbers) {
  std::map<std::tuple<std::uint32_t, float, float, float>, std::uint32_t> known;
  std::vector<std::uint32_t> joined, kept;  // per vertex; per joined vertex
  for (std::uint32_t i = 0; i < numbers.size(); ++i) {
    const Eigen::Vector3f normal = mesh.normals.empty() ? Eigen::Vector3f::Zero() : mesh.normals[i];
    const auto [entry, is_new] =
        known.try_emplace({numbers[i], normal[0], normal[1], normal[2]}, static_cast<std::uint32_t>(known.size()));
    if (is_new) kept.push_back(i);
    joined.push_back(entry->second);
  }
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) corner = joined[corner];
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {  // to smaller indices
    numbers[i] = numbers[kept[i]];
    mesh.vertices[i] = mesh.vertices[kept[i]];
    if (!mesh.normals.empty()) mesh.normals[i] = mesh.normals[kept[i]];
  }
  numbers.resize(kept.size());
  mesh.vertices.resize(kept.size());
  if (!mesh.normals.empty()) mesh.normals.resize(kept.size());
}

/// For each vertex of the graph's mesh, its number in the file.
std::vector<std::uint32_t> numbers_in(const SceneGraph& graph) {
  std::vector<std::uint32_t> numbers;
  for (const GraphNode& node : graph.nodes) {
    for (const std::uint32_t mesh : node.meshes)
      numbers.insert(numbers.end(), graph.vertex_numbers[mesh].begin(), graph.vertex_numbers[mesh].end());
  }
  return numbers;
}

/// Throws UserError unless the vertices of the mesh that is shown are those of the file with their numbers.
void check_numbers(const Mesh& shown, const std::vector<std::uint32_t>& numbers, const NumberedMesh& mesh,
                   const std::filesystem::path& file) {
  constexpr float kTolerance = 1e-5F;  // numbers are read by different programs
  bool agree = numbers.size() == shown.vertices.size();
  for (std::size_t i = 0; i < numbers.size() && agree; ++i) {
    agree = numbers[i] < mesh.vertices.size();
    if (!agree) break;
    const Eigen::Vector3f& vertex = mesh.vertices[numbers[i]];
    agree = (shown.vertices[i] - vertex).norm() <= kTolerance * (1 + vertex.norm());
  }
  if (!agree)
    fail_vertices(file,
                  "its vertices lose their numbers when it is read; export it again, without loose vertices and edges");
}

VertexFrames frames_in_mesh_axes(const VertexFile& vertices, const std::filesystem::path& mesh_file,
                                 const NumberedMesh& mesh, const WarningHandler& warn) {
  VertexFrames frames = frames_of(vertices, mesh_file, mesh);
  check_axes(frames.positions.data(), mesh, vertices, warn);
  if (vertices.axes == VertexAxes::same) return frames;
  for (Eigen::Vector3f& position : frames.positions) position = turned(position, vertices.axes);
  return frames;
}

VertexSpline spline_through(VertexFrames frames, const VertexFile& vertices) {
  try {
    return VertexSpline(std::move(frames));
  } catch (const UserError& error) {
    fail_vertices(vertices.file, error.what());
  }
}

}  // namespace

std::vector<std::filesystem::path> files_of(const VertexFile& vertices) {
  if (is_sequence(vertices)) return numbered_files(vertices.file);
  return {vertices.file};
}

std::vector<std::filesystem::path> files_if_complete(const VertexFile& vertices) {
  try {
    return files_of(vertices);
  } catch (const UserError&) {
    return {vertices.file};
  }
}

VertexFrames read_vertex_frames(const VertexFile& vertices, const std::filesystem::path& mesh) {
  return frames_in_mesh_axes(vertices, mesh, read_numbered_mesh(mesh), [](const std::string&) {});
}

SceneObject load_object_with_vertices(const std::filesystem::path& mesh_file, const VertexFile& vertices,
                                      const WarningHandler& warn, SceneLook look, SurfaceModel model) {
  const NumberedMesh mesh = read_numbered_mesh(mesh_file);
  VertexSpline spline = spline_through(frames_in_mesh_axes(vertices, mesh_file, mesh, warn), vertices);
  SceneGraph graph = read_numbered_with_assimp(mesh_file);
  for (std::size_t i = 0; i < graph.meshes.size(); ++i) join(graph.meshes[i], graph.vertex_numbers[i]);
  SceneObject object = flatten_joined(graph, mesh_file, warn, look, model, false);
  std::vector<std::uint32_t> numbers = numbers_in(graph);
  check_numbers(object.mesh, numbers, mesh, mesh_file);
  object.deformation =
      std::make_shared<const CachedDeformation>(std::move(spline), std::move(numbers), ShadingNormals(object.mesh));
  DeformedVertices start;
  object.deformation->evaluate(object.deformation->span().start, start);
  object.mesh.vertices = std::move(start.positions);
  object.mesh.normals = std::move(start.normals);
  return object;
}

}  // namespace esim::inline scene

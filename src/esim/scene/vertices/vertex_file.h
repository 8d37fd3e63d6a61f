#pragma once

#include <compare>
#include <filesystem>
#include <optional>
#include <vector>

#include "esim/scene/deformation/vertex_frames.h"
#include "esim/scene/scene.h"

namespace esim::inline scene {

/// How the axes of a file of vertices correspond to those of the mesh.
enum class VertexAxes {
  same,
  y_up,        ///< (x, y, z) of the file is (x, -z, y) of the mesh
  left_handed  ///< (x, y, z) of the file is (x, z, y) of the mesh
};

/// Where the vertices of a mesh are over time: a point cache (PC2, MDD), or numbered meshes of constant topology.
struct VertexFile {
  std::filesystem::path file;       ///< .pc2, .mdd; or .obj, .ply with one run of # for the digits: cloth_####.obj
  std::optional<double> rate_hz{};  ///< frames per second; not for MDD, which has times
  VertexAxes axes = VertexAxes::same;

  auto operator<=>(const VertexFile&) const = default;
};

/// The most frames of a file, and the most vertices that all frames may have together; these take 12 bytes each.
inline constexpr std::size_t kMaxVertexFrames = std::size_t{1} << 20;
inline constexpr std::size_t kMaxFrameVertices = std::size_t{1} << 28;

/// The files that are read: the file itself, or the numbered ones in order. Throws UserError if numbers are missing.
std::vector<std::filesystem::path> files_of(const VertexFile& vertices);

/// The same, but only the file itself if numbers are missing.
std::vector<std::filesystem::path> files_if_complete(const VertexFile& vertices);

/// The vertices, in the axes of the mesh in the OBJ or PLY file `mesh`, whose vertices they are. Throws UserError,
/// naming the file, if it cannot be read or is damaged, or if its vertices or faces are not those of the mesh.
VertexFrames read_vertex_frames(const VertexFile& vertices, const std::filesystem::path& mesh);

/// Loads an OBJ or PLY file as one object, as load_scene_object() does, whose vertices move as in the other file. Times
/// begin at 0; in MDD files, they are those of the file. Warns if the vertices seem to have other axes. Throws
/// UserError as read_vertex_frames() and load_scene_object().
SceneObject load_object_with_vertices(const std::filesystem::path& mesh, const VertexFile& vertices,
                                      const WarningHandler& warn, SceneLook look,
                                      SurfaceModel model = SurfaceModel::matte);

}  // namespace esim::inline scene

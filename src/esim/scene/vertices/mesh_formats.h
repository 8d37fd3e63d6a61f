#pragma once

#include "esim/scene/vertices/numbered_mesh.h"

// Private to scene.
namespace esim::inline scene {

// One function per format, for read_numbered_mesh().
NumberedMesh read_obj_numbers(const std::filesystem::path& file);
NumberedMesh read_ply_numbers(const std::filesystem::path& file);

/// Throws UserError, naming the file and the vertex, unless all coordinates are finite and at most 1e9 from 0, beyond
/// which single precision is useless. `where` is added behind the number.
void check_vertex(const std::filesystem::path& file, std::size_t number, const Eigen::Vector3f& vertex,
                  const std::string& where = {});

}  // namespace esim::inline scene

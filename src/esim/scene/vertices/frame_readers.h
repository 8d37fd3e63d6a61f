#pragma once

#include <filesystem>
#include <vector>

#include "esim/scene/vertices/numbered_mesh.h"
#include "esim/scene/vertices/vertex_file.h"

// Private to scene.
namespace esim::inline scene {

// One function per format, for read_vertex_frames(). The frames have the axes of their file.
VertexFrames read_pc2(const VertexFile& vertices, std::size_t expected);
VertexFrames read_mdd(const VertexFile& vertices, std::size_t expected);
VertexFrames read_mesh_sequence(const VertexFile& vertices, const std::filesystem::path& mesh_file,
                                const NumberedMesh& mesh);

/// The numbered files of a pattern, in order.
std::vector<std::filesystem::path> numbered_files(const std::filesystem::path& pattern);

/// Times of so many frames at a rate, from 0 on. Throws UserError if the rate is missing or not positive, or if the
/// frames last too long.
std::vector<double> times_at_rate(const VertexFile& vertices, std::size_t frames, double frames_per_sample = 1);

/// Throws UserError, naming the file, if it has more frames and vertices than fit, or other vertices than the mesh.
void check_counts(const std::filesystem::path& file, std::size_t frames, std::size_t vertices, std::size_t expected);

}  // namespace esim::inline scene

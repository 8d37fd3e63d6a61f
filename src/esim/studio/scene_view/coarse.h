#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esim::studio {

/// Triangles as a browser draws them: per vertex 3 numbers of its position and 2 of its texture coordinates.
struct Surface {
  std::span<const float> positions, texture_uv;
  std::span<const std::uint32_t> indices;  ///< 3 per triangle
};

/// About `wanted` triangles, or fewer, between vertices that the surface has: of those within a cell of a grid whose
/// texture coordinates lie close together, the first replaces the others (J. Rossignac and P. Borrel, Multi-resolution
/// 3D approximations for rendering complex scenes, 1993). The surface's own triangles if they are few enough.
/// meshopt_simplifySloppy() is not used, since it merges vertices whose texture coordinates are far apart;
/// meshopt_simplify() keeps them apart, but takes 30 times longer.
std::vector<std::uint32_t> coarse_indices(const Surface& surface, std::size_t wanted);

}  // namespace esim::studio

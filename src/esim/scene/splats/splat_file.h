#pragma once

#include <filesystem>

#include "esim/scene/mesh.h"
#include "esim/scene/splats/splats.h"

namespace esim::inline scene {

/// Reads a scene of Gaussian splats. The content of the file, not its name, determines the format, except for .splat,
/// which has no header:
///  - PLY of 3D Gaussian splatting, with 2D splats (no scale_2), of degree 0 to 3; properties in any order;
///  - PLY as compressed by PlayCanvas (`element chunk`);
///  - .splat: 32 bytes per splat;
///  - .spz, versions 1 to 4;
///  - .sog, versions 1 and 2, as a ZIP file, or its meta.json in a folder;
///  - glTF (.glb, .gltf) with KHR_gaussian_splatting, also of its drafts.
/// Positions are in the file's own axes, which usually are right, down, forward; those of .spz are converted to these.
/// glTF is as in other scenes: z is up, and the transforms of nodes are applied, with their uniform scales.
///
/// Splats with numbers that are not finite, with a rotation of zero, with a standard deviation that is negative or
/// above 1e6 m, or with an opacity outside 0 to 1 are dropped, with a warning that counts them. Throws UserError,
/// naming the file, if it cannot be read, is damaged or truncated, is of another kind, or has no splats.
Splats load_splats(const std::filesystem::path& path, const WarningHandler& warn);

/// Whether a file is one of these.
bool is_splat_file(const std::filesystem::path& path);

}  // namespace esim::inline scene

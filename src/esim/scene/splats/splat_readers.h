#pragma once

#include <filesystem>
#include <string_view>

#include "esim/scene/mesh.h"
#include "esim/scene/splats/splats.h"

// Private to scene: the readers of load_splats, one per file of this folder. All throw UserError as it does.
namespace esim::inline scene {

/// PLY, plain or compressed by PlayCanvas.
Splats read_splat_ply(const std::filesystem::path& file, const WarningHandler& warn);
bool is_splat_ply(const std::filesystem::path& file);

/// .splat: 32 bytes per splat, without a header.
Splats read_dot_splat(const std::filesystem::path& file, const WarningHandler& warn);

/// .spz, versions 1 to 4.
Splats read_spz(const std::filesystem::path& file, const WarningHandler& warn);

/// Whether a file that is compressed by gzip is an .spz.
bool is_gzip_spz(const std::filesystem::path& file);

/// .sog, versions 1 and 2, as a ZIP file, and its meta.json in a folder.
Splats read_sog_zip(const std::filesystem::path& file, const WarningHandler& warn);
Splats read_sog_folder(const std::filesystem::path& meta, const WarningHandler& warn);
bool is_sog_zip(const std::filesystem::path& file);

/// Whether the text of a JSON file is that of a meta.json.
bool is_sog_meta(std::string_view json);

/// glTF with KHR_gaussian_splatting.
Splats read_splat_gltf(const std::filesystem::path& file, const WarningHandler& warn);

}  // namespace esim::inline scene

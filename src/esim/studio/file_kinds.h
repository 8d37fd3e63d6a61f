#pragma once

#include <filesystem>
#include <string_view>

namespace esim::studio {

enum class FileKind { folder, scenario, scene, recording, image, trajectory, other };

/// The kind of a file by its name, or of a folder by its name and contents.
FileKind kind_of(const std::filesystem::path& place);

/// "scenario", ...
std::string_view name_of(FileKind kind);

}  // namespace esim::studio

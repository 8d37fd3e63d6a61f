#pragma once

#include <filesystem>
#include <string_view>

namespace esim::studio {

enum class FileKind { folder, scenario, scene, recording, image, trajectory, other };

/// What a file or folder is, by its name, and of folders by what they have in them.
FileKind kind_of(const std::filesystem::path& place);

/// "scenario", ...
std::string_view name_of(FileKind kind);

}  // namespace esim::studio

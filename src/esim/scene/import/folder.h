#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace esim {

/// A file that a scene names, if the scene may have it.
struct FolderPath {
  std::optional<std::filesystem::path> path;
  std::string reason;  ///< why not, to go on with "its texture 'NAME' ..."
};

/// What `name` stands for in `folder`: a path relative to it that stays inside it, links resolved too. A scene that
/// comes from somewhere else may not read the rest of the machine: of absolute paths, and of those that lead out of the
/// folder, only the last part counts, and only if a file of that name lies in the folder itself (exporters like to
/// write the paths of the machine they ran on). Other URIs are refused.
FolderPath path_inside(const std::filesystem::path& folder, std::string name);

/// Undoes %20 and the like.
std::string percent_decoded(const std::string& uri);

/// The whole of a file. Throws UserError naming it when it is no regular file, larger than 2 GiB, or unreadable.
std::vector<std::byte> read_bytes(const std::filesystem::path& file);

}  // namespace esim

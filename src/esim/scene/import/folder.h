#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace esim::inline scene {

/// A file that a scene refers to, if the scene may read it.
struct FolderPath {
  std::optional<std::filesystem::path> path;
  std::string reason;  ///< why it may not, as the end of a sentence: "its texture 'NAME' ..."
};

/// Resolves `name`, including links, to a path inside `folder`. Scenes from untrusted sources must not read other files
/// of the computer: for absolute paths, and for paths that lead out of the folder, only the last component is used, and
/// only if the folder itself contains a file of that name (exporters often write paths of their own computer). Other
/// URIs are rejected.
FolderPath path_inside(const std::filesystem::path& folder, std::string name);

/// Decodes %20 and the like.
std::string percent_decoded(const std::string& uri);

/// Reads a file. Throws UserError, naming it, if it is not a regular file, larger than 2 GiB, or unreadable.
std::vector<std::byte> read_bytes(const std::filesystem::path& file);

}  // namespace esim::inline scene

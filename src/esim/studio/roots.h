#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace esim::studio {

/// The only folders in which files are read and written. Outside of this class, paths are "NAME/rest/of/path", where
/// NAME is the name of a root.
class Roots {
 public:
  struct Root {
    std::string name;
    std::filesystem::path folder;  ///< with links resolved
  };

  /// Roots have the names of their folders, with numbers added to duplicates. Throws UserError if one is not a folder.
  explicit Roots(const std::vector<std::filesystem::path>& folders);

  const std::vector<Root>& list() const { return roots_; }

  /// The canonical place of a path, which need not exist. Throws HttpError 400 for invalid paths, and 403 if it leads
  /// out of its root, also through links.
  std::filesystem::path resolve(const std::string& path) const;

  /// The same for a path that must exist; throws HttpError 404 otherwise.
  std::filesystem::path existing(const std::string& path) const;

  /// Whether a place is a root or below one, with links resolved.
  bool contains(const std::filesystem::path& place) const;

  /// "NAME/rest/of/path" of a place; empty if it is not below a root.
  std::string name_of(const std::filesystem::path& place) const;

 private:
  std::vector<Root> roots_;
};

}  // namespace esim::studio

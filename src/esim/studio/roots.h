#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace esim::studio {

/// The folders below which files are read and written, and nowhere else. Outside of this class their paths are
/// "NAME/rest/of/path", NAME being that of a root.
class Roots {
 public:
  struct Root {
    std::string name;
    std::filesystem::path folder;  ///< without links
  };

  /// Names are those of the folders, told apart by numbers. Throws UserError for what is no folder.
  explicit Roots(const std::vector<std::filesystem::path>& folders);

  const std::vector<Root>& list() const { return roots_; }

  /// The place of a path, which need not exist, without links. Throws HttpError 400 for what is no such path, 403 where
  /// it leads out of its root, also by way of links.
  std::filesystem::path resolve(const std::string& path) const;

  /// The same of what must exist: HttpError 404 otherwise.
  std::filesystem::path existing(const std::string& path) const;

  /// Whether a place is a root or below one, links resolved.
  bool contains(const std::filesystem::path& place) const;

  /// "NAME/rest/of/path" of a place; empty where it is below no root.
  std::string name_of(const std::filesystem::path& place) const;

 private:
  std::vector<Root> roots_;
};

}  // namespace esim::studio

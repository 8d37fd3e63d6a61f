#include "esim/studio/roots.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/studio/server/http.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& place, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first == folder.end();
}

/// The canonical form of a path that may not exist; links of existing parts are resolved.
fs::path without_links(const fs::path& place) {
  std::error_code error;
  fs::path canonical = fs::weakly_canonical(fs::absolute(place), error);
  if (error) throw HttpError(403, place.filename().string() + ": is not accessible: " + error.message());
  return canonical.has_filename() ? canonical : canonical.parent_path();
}

}  // namespace

Roots::Roots(const std::vector<fs::path>& folders) {
  for (const fs::path& folder : folders) {
    std::error_code error;
    if (!fs::is_directory(folder, error)) throw UserError(fmt::format("{}: no such folder", folder.string()));
    Root root{"", without_links(folder)};
    const bool known =
        std::any_of(roots_.begin(), roots_.end(), [&](const Root& other) { return other.folder == root.folder; });
    if (known) continue;
    const std::string base = root.folder.has_filename() ? root.folder.filename().string() : "root";
    const auto taken = [&](const std::string& name) {
      return std::any_of(roots_.begin(), roots_.end(), [&](const Root& other) { return other.name == name; });
    };
    root.name = base;
    for (int number = 2; taken(root.name); ++number) root.name = fmt::format("{}-{}", base, number);
    roots_.push_back(std::move(root));
  }
}

fs::path Roots::resolve(const std::string& path) const {
  const std::size_t slash = std::min(path.find('/'), path.size());
  const std::string name = path.substr(0, slash);
  const auto root = std::find_if(roots_.begin(), roots_.end(), [&](const Root& r) { return r.name == name; });
  if (root == roots_.end())
    throw HttpError(403,
                    fmt::format("{}: must be in one of the folders that are open; add a folder with --root", path));
  fs::path place = root->folder;
  std::size_t begin = slash;
  while (begin < path.size()) {
    const std::size_t end = std::min(path.find('/', begin + 1), path.size());
    const std::string part = path.substr(begin + 1, end - begin - 1);
    if (part == ".." || part == "." || part.find('\0') != std::string::npos || part.find('\\') != std::string::npos)
      throw HttpError(400, fmt::format("{}: a path must not have the part '{}'", path, part));
    if (!part.empty()) place /= part;
    begin = end;
  }
  place = without_links(place);
  if (!is_below(place, root->folder)) throw HttpError(403, path + ": must not lead out of its folder");
  // A remaining link points to a file that does not exist yet, possibly outside.
  std::error_code error;
  for (fs::path part = place; part != root->folder; part = part.parent_path()) {
    if (fs::is_symlink(fs::symlink_status(part, error)))
      throw HttpError(403, path + ": must not lead out of its folder");
  }
  return place;
}

fs::path Roots::existing(const std::string& path) const {
  const fs::path place = resolve(path);
  std::error_code error;
  if (!fs::exists(place, error)) throw HttpError(404, path + ": no such file or folder");
  return place;
}

bool Roots::contains(const fs::path& place) const {
  const fs::path canonical = without_links(place);
  return std::any_of(roots_.begin(), roots_.end(), [&](const Root& root) { return is_below(canonical, root.folder); });
}

std::string Roots::name_of(const fs::path& place) const {
  const fs::path canonical = without_links(place);
  for (const Root& root : roots_) {
    if (canonical == root.folder) return root.name;
    if (is_below(canonical, root.folder)) return root.name + "/" + canonical.lexically_relative(root.folder).string();
  }
  return "";
}

}  // namespace esim::studio

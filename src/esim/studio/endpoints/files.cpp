#include <algorithm>
#include <array>
#include <thread>

#include "esim/recording/format.h"
#include "esim/studio/endpoints/endpoints.h"
#include "esim/studio/file_kinds.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxEntries = 10'000;

Json list(const Roots& roots, const fs::path& folder, const std::string& name) {
  struct Entry {
    bool is_folder;
    std::string name;
    fs::path place;
  };
  std::vector<Entry> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end && found.size() < kMaxEntries;
       entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    if (file.starts_with('.') || !roots.contains(entry->path())) continue;
    std::error_code unreadable;
    found.push_back({entry->is_directory(unreadable), file, entry->path()});
  }
  std::sort(found.begin(), found.end(), [](const Entry& a, const Entry& b) {
    return std::pair(!a.is_folder, a.name) < std::pair(!b.is_folder, b.name);
  });
  Json entries = Json::array();
  for (const Entry& entry : found) {
    std::error_code unreadable;
    const auto bytes = entry.is_folder ? 0 : fs::file_size(entry.place, unreadable);
    entries.push_back({{"name", entry.name},
                       {"path", name + "/" + entry.name},
                       {"kind", name_of(kind_of(entry.place))},
                       {"bytes", unreadable ? 0 : bytes}});
  }
  return {{"dir", name}, {"entries", entries}};
}

}  // namespace

void add_files(Router& router, const Roots& roots, const StudioOptions& options) {
  router.add("GET", "/api/session", [&roots, opened = options.opened](const Request&) {
    Json names = Json::array();
    for (const Roots::Root& root : roots.list()) names.push_back({{"name", root.name}});
    const std::string kind = opened.empty() ? "nothing" : std::string(name_of(kind_of(opened)));
    return json_response({{"version", ESIM_VERSION},
                          {"opened", {{"kind", kind}, {"path", opened.empty() ? "" : roots.name_of(opened)}}},
                          {"roots", names},
                          {"cores", std::max(1U, std::thread::hardware_concurrency())}});
  });
  router.add("GET", "/api/files", [&roots](const Request& request) {
    const auto dir = request.query.find("dir");
    std::string name = dir == request.query.end() ? roots.list().front().name : dir->second;
    while (name.ends_with('/')) name.pop_back();
    const fs::path folder = roots.existing(name);
    std::error_code error;
    if (!fs::is_directory(folder, error)) throw HttpError(400, name + ": must be a folder");
    return json_response(list(roots, folder, name));
  });
}

}  // namespace esim::studio

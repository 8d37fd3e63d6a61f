#include "esim/studio/studio.h"

#include <fmt/format.h>

#include <thread>

#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "esim/studio/endpoints/endpoints.h"
#include "esim/studio/file_kinds.h"
#include "esim/studio/server/access.h"
#include "esim/studio/server/server.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

constexpr int kPortsTried = 50;

std::vector<fs::path> roots_of(const StudioOptions& options) {
  std::vector<fs::path> folders;
  std::error_code error;
  if (!options.opened.empty()) {
    const fs::path opened = fs::absolute(options.opened / "").lexically_normal().parent_path();
    if (!fs::exists(opened, error)) throw UserError(fmt::format("{}: no such file or folder", options.opened.string()));
    const bool browsed = kind_of(opened) == FileKind::folder;
    folders.push_back(browsed ? opened : opened.parent_path());
  }
  folders.insert(folders.end(), options.roots.begin(), options.roots.end());
  if (folders.empty()) folders.push_back(fs::current_path());
  return folders;
}

std::string token_of(const StudioOptions& options) {
  constexpr std::size_t kMin = 16;
  if (options.token.empty()) {
    if (is_loopback(options.host)) return random_token();
    throw UserError(
        fmt::format("--host {}: other machines can reach this address; restrict access with --token", options.host));
  }
  const bool plain = options.token.find_first_not_of(
                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") == std::string::npos;
  if (!plain || options.token.size() < kMin)
    throw UserError(fmt::format("--token: must have at least {} characters: letters, digits, _ and -", kMin));
  return options.token;
}

void require_pages(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(folder / "index.html", error))
    throw UserError(
        fmt::format("the studio's page is missing ({}): build it with scripts/studio, which needs npm, or "
                    "give its folder with --page",
                    (folder / "index.html").string()));
}

}  // namespace

struct Studio::Impl {
  explicit Impl(const StudioOptions& given)
      : options(given),
        token(token_of(given)),
        roots(roots_of(given)),
        scenes(given.threads),
        runs(given.threads),
        server({given.host, given.port == 0 ? kStudioPort : given.port, given.port == 0 ? kPortsTried : 1}),
        access(token, given.host, server.port()) {
    add_files(router, roots, options);
    add_scenarios(router, roots);
    const Workshop workshop{roots, scenes, runs, recordings, sensors, options.threads};
    add_scenes(router, workshop);
    add_motion(router, workshop);
    add_runs(router, workshop);
    add_recordings(router, workshop);
    add_sensors(router, workshop);
    add_pages(router, options.pages);
    server.start([this](const RequestHead& head) { return access.answer(head); },
                 [this](const Request& request) { return router.answer(request); });
    load_ahead = std::thread([this] { load(); });
  }

  ~Impl() {
    server.stop();
    load_ahead.join();
  }

  /// Loads the scene in advance, since the page will request it.
  void load() {
    try {
      if (!options.opened.empty() && kind_of(options.opened) == FileKind::scenario)
        scenes.of(read_scenario(options.opened));
    } catch (const std::exception&) {  // reported when the page requests it
    }
  }

  StudioOptions options;
  std::string token;
  Roots roots;
  SceneStore scenes;
  Runs runs;
  Recordings recordings;
  SensorPreviews sensors;
  HttpServer server;
  Access access;
  Router router;
  std::thread load_ahead;
};

Studio::Studio(const StudioOptions& options) {
  require_pages(options.pages);
  impl_ = std::make_unique<Impl>(options);
}

Studio::~Studio() = default;

std::string Studio::url() const {
  const std::string& host = impl_->options.host;
  const std::string shown = host == "0.0.0.0"                     ? "127.0.0.1"
                            : host.find(':') != std::string::npos ? "[" + host + "]"
                                                                  : host;
  return fmt::format("http://{}:{}/?token={}", shown, impl_->server.port(), impl_->token);
}

}  // namespace esim::studio

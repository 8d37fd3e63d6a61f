#include "esim/compose/engines/engine_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "esim/blender/blender.h"
#include "esim/core/error.h"
#include "esim/core/inputs/file_hashes.h"

namespace esim::inline compose {
namespace {

namespace fs = std::filesystem;

/// Whether all that determines the images can be identified: the scene is in a file that Blender opens for this
/// simulation, and the other files that it needs are known.
bool is_identified(const RendererOptions& renderer) {
  const auto* const blender = std::get_if<BlenderRendererOptions>(&renderer);
  if (blender == nullptr || !blender->address.empty()) return false;
  const fs::path extension = blender->scene.extension();
  return is_blend(blender->scene) || extension == ".glb" || extension == ".ply";
}

/// The names, sizes and times of the files in a folder.
std::string state_of_folder(const fs::path& folder) {
  std::vector<std::string> states;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const UsedFile file = used_file(it->path());
    states.push_back(fmt::format("{} {} {}", it->path().filename().string(), file.bytes, file.changed_ns));
  }
  std::ranges::sort(states);
  return fmt::format("{}", fmt::join(states, "\n"));
}

}  // namespace

std::optional<std::vector<std::string>> identities_of(const std::vector<UsedFile>& files,
                                                      const NoticeHandler& warning) {
  std::vector<std::string> identities;
  FileHashes hashes;
  for (const UsedFile& file : files) {
    if (file.regular) {
      hashes.add(file);
    } else {
      identities.push_back(state_of_folder(file.path));
    }
  }
  for (const HashedFile& file : hashes.finish(true)) {
    if (!file.problem.empty()) {
      warning(fmt::format("images are not cached: {} {}", file.file.path.string(), file.problem));
      return std::nullopt;
    }
    identities.push_back(file.file.sha256);
  }
  return identities;
}

std::string identity_of_images(const UnrealcvOptions& options, UnrealcvClient& client,
                               const std::vector<std::string>& others) {
  return nlohmann::json{
      ESIM_VERSION,       source_commit(),     options.name,           options.camera, options.pipelined,
      options.lag_frames, options.light_image, options.light,          options.depth,  options.mask,
      options.exposure,   options.objects,     description_by(client), others}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::shared_ptr<ImageCache> open_image_cache(const ImageCacheOptions& options, const RendererOptions& renderer,
                                             const NoticeHandler& warning) {
  if (!options.use) return nullptr;
  const bool is_named = !options.folder.empty(),
             is_wanted = is_named || options.max_bytes != ImageCacheOptions{}.max_bytes;
  if (engine_objects(renderer) == nullptr) {
    if (is_wanted)
      warning(
          "the image cache has no effect: it is for the renderers blender and unrealcv, whose images are expensive");
    return nullptr;
  }
  if (is_named) return std::make_shared<ImageCache>(options.folder, options.max_bytes, warning);
  if (!is_identified(renderer)) {
    if (is_wanted) warning("images are not cached: esim cannot identify this scene; name a folder for its images");
    return nullptr;
  }
  try {
    return std::make_shared<ImageCache>(cache_folder() / "images", options.max_bytes, warning);
  } catch (const UserError& error) {
    warning(fmt::format("images are not cached: {}", error.what()));
    return nullptr;
  }
}

std::optional<EngineImages> engine_images(const std::shared_ptr<ImageCache>& cache) {
  if (cache == nullptr) return std::nullopt;
  return EngineImages{cache->from_engine, cache->from_cache, cache->folder().string()};
}

}  // namespace esim::inline compose

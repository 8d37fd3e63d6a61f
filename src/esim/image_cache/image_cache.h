#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace esim::inline image_cache {

/// A folder of images, compressed and each in a file of its own, which several processes may share. An image appears
/// in one step, by renaming a complete file, so that processes that are killed leave no damaged ones. Reading an image
/// marks it as used; while the folder is above its limit, the least recently used images are removed. A cache never
/// fails: problems are warned of once, and the simulation continues without it. Not for several threads at a time.
class ImageCache {
 public:
  using Warning = std::function<void(const std::string&)>;

  /// Creates the folder only when the first image is stored. `max_bytes` counts the files of all processes. It may be
  /// exceeded by what was stored since the latest count, at most a sixteenth by each process.
  ImageCache(std::filesystem::path folder, std::uint64_t max_bytes, Warning warning);

  const std::filesystem::path& folder() const { return folder_; }

  /// The image with this key, which has `bytes` bytes; empty if it is missing or damaged.
  std::optional<std::string> load(const std::string& key, std::size_t bytes);

  /// Stores an image. `key` is a SHA-256 sum of everything that determines it.
  void store(const std::string& key, std::string_view image);

  /// What the renderers that use this cache have delivered.
  std::int64_t from_cache = 0, from_engine = 0;

 private:
  std::filesystem::path file_of(const std::string& key) const;
  void write(const std::string& key, std::string_view image);
  void count_and_evict();

  std::filesystem::path folder_;
  std::uint64_t max_bytes_;
  Warning warning_;
  std::optional<std::uint64_t> counted_;  // bytes of all images when they were counted
  std::uint64_t stored_since_ = 0;        // bytes, by this object
  bool cannot_store_ = false, warned_of_damage_ = false;
};

}  // namespace esim::inline image_cache

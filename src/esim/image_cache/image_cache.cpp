#include "esim/image_cache/image_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/files/output_file.h"

namespace esim::inline image_cache {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".image";
constexpr std::size_t kKeyDigits = 64;

// The lowest bytes of an engine's numbers are noise: higher levels take longer without making them smaller.
constexpr int kLevel = 1;

/// The part of a file's name after its key; empty for files that are not the cache's.
std::string extension_after_key(const fs::path& file) {
  const std::string name = file.filename().string();
  const std::size_t digits = std::min(name.find_first_not_of("0123456789abcdef"), name.size());
  return digits == kKeyDigits ? name.substr(digits) : "";
}

}  // namespace

ImageCache::ImageCache(fs::path folder, std::uint64_t max_bytes, Warning warning)
    : folder_(std::move(folder)), max_bytes_(max_bytes), warning_(std::move(warning)) {}

fs::path ImageCache::file_of(const std::string& key) const { return folder_ / (key + std::string(kExtension)); }

std::optional<std::string> ImageCache::load(const std::string& key, std::size_t bytes) {
  const fs::path path = file_of(key);
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return std::nullopt;
  std::optional<std::string> image;
  const std::streamoff size = file.tellg();
  // Incompressible images become slightly larger.
  if (size > 0 && static_cast<std::size_t>(size) <= 2 * bytes + 1024) {
    std::string frame(static_cast<std::size_t>(size), '\0');
    file.seekg(0);
    image.emplace(bytes, '\0');
    if (!file.read(frame.data(), size) || !decompress_zstandard(frame, *image)) image.reset();
  }
  std::error_code ignored;
  if (image) {
    fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
  } else if (!std::exchange(warned_of_damage_, true)) {
    warning_(fmt::format("the image cache has damaged images, such as {}; they are rendered again", path.string()));
  }
  return image;
}

void ImageCache::store(const std::string& key, std::string_view image) {
  if (cannot_store_) return;
  try {
    if (!counted_) {
      create_folder(folder_);
      count_and_evict();
    }
    write(key, image);
    if (*counted_ + stored_since_ > max_bytes_ || stored_since_ > max_bytes_ / 16) count_and_evict();
  } catch (const OutputError& error) {
    cannot_store_ = true;
    warning_(fmt::format(
        "image cache: {}; further images are not stored. Make space, choose another folder, or turn the cache off",
        error.what()));
  }
}

void ImageCache::write(const std::string& key, std::string_view image) {
  std::string frame;
  compress_zstandard(image, kLevel, frame);
  std::random_device random;
  const fs::path draft = folder_ / fmt::format("{}.{:08x}{:08x}{}", key, random(), random(), kTemporaryExtension);
  std::error_code error, ignored;
  try {
    // Without fsync: what a power failure damages is rendered again.
    OutputFile file(draft);
    file.append(frame);
    file.flush();
  } catch (const OutputError&) {
    fs::remove(draft, ignored);
    throw;
  }
  fs::rename(draft, file_of(key), error);
  if (error) {
    fs::remove(draft, ignored);
    throw_cannot_write(file_of(key), error.message());
  }
  stored_since_ += frame.size();
}

/// Counts the bytes of all images. Above the limit, removes the least recently used ones until a tenth is free. Other
/// processes may do the same at the same time. Also removes what killed processes did not complete.
void ImageCache::count_and_evict() {
  struct Entry {
    fs::file_time_type used;
    std::uint64_t bytes;
    fs::path path;
  };
  constexpr auto kLongestWrite = std::chrono::hours(1);
  const auto now = fs::file_time_type::clock::now();
  std::vector<Entry> entries;
  std::uint64_t bytes = 0;
  std::error_code error;
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
    const std::string extension = extension_after_key(it->path());
    std::error_code gone;
    const Entry entry{it->last_write_time(gone), it->file_size(gone), it->path()};
    if (gone) continue;
    if (extension == kExtension) {
      entries.push_back(entry);
      bytes += entry.bytes;
    } else if (extension.ends_with(kTemporaryExtension) && now - entry.used > kLongestWrite) {
      fs::remove(entry.path, gone);
    }
  }
  if (bytes > max_bytes_) {
    std::ranges::sort(entries, {}, &Entry::used);
    for (const Entry& entry : entries) {
      if (bytes <= max_bytes_ - max_bytes_ / 10) break;
      std::error_code failed;
      fs::remove(entry.path, failed);
      if (!failed) bytes -= entry.bytes;
    }
  }
  counted_ = bytes;
  stored_since_ = 0;
}

}  // namespace esim::inline image_cache

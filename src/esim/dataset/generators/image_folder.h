#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "esim/scene/images/texture.h"

namespace esim::inline dataset {

/// The images in a folder and its subfolders, as luminance. Images are read on first use; the latest ones are kept.
/// Safe to use from several threads.
class ImageFolder {
 public:
  struct Picture {
    std::string name;  ///< path relative to the folder
    std::shared_ptr<const Texture> light;
    std::map<std::string, std::string> passed_over{};  ///< unusable images before it and the reasons
  };

  /// Lists the images. Throws UserError if the folder does not exist or has no images.
  explicit ImageFolder(std::filesystem::path folder);

  std::size_t size() const { return files_.size(); }

  /// Image `number` modulo size(); if it is unusable, the next usable one. Images are unusable if they cannot be
  /// decoded, have a side of less than 32 px, or more than 2^26 px. Throws UserError if none is usable, with the reason
  /// for one of them.
  Picture pick(std::uint64_t number) const;

  /// A checksum of the names and sizes of the files.
  std::uint32_t fingerprint() const { return fingerprint_; }

 private:
  struct File {
    std::string name;
    std::uintmax_t bytes = 0;
  };
  using Kept = std::list<std::pair<std::size_t, std::shared_ptr<const Texture>>>;

  /// Null if it is unusable.
  std::shared_ptr<const Texture> texture(std::size_t index) const;
  std::shared_ptr<const Texture> load(std::size_t index) const;

  std::filesystem::path folder_;
  std::vector<File> files_;
  std::uint32_t fingerprint_ = 0;

  mutable std::mutex mutex_;
  mutable Kept kept_;  // the latest first
  mutable std::map<std::size_t, Kept::iterator> where_;
  mutable std::size_t kept_texels_ = 0;
  mutable std::map<std::size_t, std::string> unusable_;  // with the reasons
};

}  // namespace esim::inline dataset

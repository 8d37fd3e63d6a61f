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

#include "esim/scene/texture.h"

namespace esim {

/// The images in a folder and the folders in it, as luminance. They are read when they are first wanted; the latest
/// ones are kept. Any number of threads may ask.
class ImageFolder {
 public:
  struct Picture {
    std::string name;  ///< its path in the folder
    std::shared_ptr<const Texture> light;
    std::map<std::string, std::string> passed_over{};  ///< images before it that cannot be used, and why
  };

  /// Lists them. Throws UserError where there is no such folder or no image in it.
  explicit ImageFolder(std::filesystem::path folder);

  std::size_t size() const { return files_.size(); }

  /// The image with this number, round and round; where it is unusable, the next one that is usable. Unusable are those
  /// that cannot be decoded, with a side of less than 32 px, or of more than 2^26 px. Throws UserError if none is left,
  /// saying what is wrong with one of them.
  Picture pick(std::uint64_t number) const;

  /// A number that other names or sizes of the files change.
  std::uint32_t fingerprint() const { return fingerprint_; }

 private:
  struct File {
    std::string name;
    std::uintmax_t bytes = 0;
  };
  using Kept = std::list<std::pair<std::size_t, std::shared_ptr<const Texture>>>;

  /// Null where it is unusable.
  std::shared_ptr<const Texture> texture(std::size_t index) const;
  std::shared_ptr<const Texture> load(std::size_t index) const;

  std::filesystem::path folder_;
  std::vector<File> files_;
  std::uint32_t fingerprint_ = 0;

  mutable std::mutex mutex_;
  mutable Kept kept_;  // the latest first
  mutable std::map<std::size_t, Kept::iterator> where_;
  mutable std::size_t kept_texels_ = 0;
  mutable std::map<std::size_t, std::string> unusable_;  // and why
};

}  // namespace esim

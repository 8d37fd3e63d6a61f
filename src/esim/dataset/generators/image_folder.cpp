#include "esim/dataset/generators/image_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <span>

#include "esim/core/error.h"
#include "esim/dataset/files/checksum.h"
#include "esim/files/input_file.h"
#include "esim/scene/images/image_file.h"
#include "esim/scene/images/image_header.h"

namespace esim::inline dataset {
namespace {

namespace fs = std::filesystem;

constexpr int kMinSide_px = 32;
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;
constexpr int kLargestSide_px = 1536;  // larger images are reduced to this
constexpr std::size_t kMaxTexelsKept = std::size_t{1} << 27;

constexpr std::array<const char*, 9> kExtensions{".png",  ".jpg", ".jpeg", ".exr", ".hdr",
                                                 ".webp", ".ppm", ".pgm",  ".pnm"};

bool is_image(const fs::path& file) {
  return std::find(kExtensions.begin(), kExtensions.end(), lower_extension(file)) != kExtensions.end();
}

/// Throws UserError for an unsupported size.
void check_size(const fs::path& file, std::int64_t width, std::int64_t height) {
  if (std::min(width, height) < kMinSide_px) {
    throw UserError(fmt::format("image {}: {}x{} px is too small; each side must have at least {} px", file.string(),
                                width, height, kMinSide_px));
  }
  if (width > kMaxPixels / height) {
    throw UserError(
        fmt::format("image {}: {}x{} px is too large; it must have at most 2^26 px", file.string(), width, height));
  }
}

/// The same for the size in the file's header, if any, before a decoder allocates memory for it.
void check_header(const fs::path& file) {
  std::vector<std::byte> head(kImageHeadBytes);
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  const auto bytes = std::span(head).first(static_cast<std::size_t>(stream.gcount()));
  if (const auto size = size_in_header(bytes)) check_size(file, size->width, size->height);
}

/// Reduces large images to means over areas.
Image<float> reduced(Image<float> image) {
  const int side = std::max(image.width(), image.height());
  if (side <= kLargestSide_px) return image;
  const double factor = static_cast<double>(kLargestSide_px) / side;
  Image<float> smaller(std::max(1, static_cast<int>(std::lround(factor * image.width()))),
                       std::max(1, static_cast<int>(std::lround(factor * image.height()))));
  const cv::Mat from(image.height(), image.width(), CV_32F, image.data());
  cv::Mat to(smaller.height(), smaller.width(), CV_32F, smaller.data());
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return smaller;
}

}  // namespace

ImageFolder::ImageFolder(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  if (!fs::is_directory(folder_, error))
    throw UserError(fmt::format("{}: must be a folder of images", folder_.string()));
  for (auto entry = fs::recursive_directory_iterator(folder_, fs::directory_options::skip_permission_denied, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code unreadable;
    if (!is_image(entry->path()) || !entry->is_regular_file(unreadable)) continue;
    files_.push_back({entry->path().lexically_relative(folder_).generic_string(), entry->file_size(unreadable)});
  }
  if (error) throw UserError(fmt::format("{}: cannot be listed: {}", folder_.string(), error.message()));
  if (files_.empty())
    throw UserError(
        fmt::format("{}: has no images; supported are PNG, JPEG, WebP, PGM, PPM, EXR and HDR", folder_.string()));
  std::sort(files_.begin(), files_.end(), [](const File& a, const File& b) { return a.name < b.name; });

  for (const File& file : files_) fingerprint_ = crc32(fmt::format("{}\n{}\n", file.name, file.bytes), fingerprint_);
}

ImageFolder::Picture ImageFolder::pick(std::uint64_t number) const {
  std::map<std::string, std::string> passed_over;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    const auto index = static_cast<std::size_t>((number + i) % files_.size());
    if (auto light = texture(index)) return {files_[index].name, std::move(light), std::move(passed_over)};
    const std::lock_guard locked(mutex_);
    passed_over.emplace(files_[index].name, unusable_.at(index));
  }
  throw UserError(fmt::format("{}: none of its {} images can be used, for example: {}", folder_.string(), files_.size(),
                              passed_over.begin()->second));
}

std::shared_ptr<const Texture> ImageFolder::texture(std::size_t index) const {
  {
    const std::lock_guard locked(mutex_);
    if (unusable_.contains(index)) return nullptr;
    if (const auto found = where_.find(index); found != where_.end()) {
      kept_.splice(kept_.begin(), kept_, found->second);
      return found->second->second;
    }
  }
  std::shared_ptr<const Texture> loaded;
  std::string problem;
  try {
    loaded = load(index);
  } catch (const UserError& error) {
    problem = error.what();
  }
  const std::lock_guard locked(mutex_);
  if (loaded == nullptr) {
    unusable_.emplace(index, problem);
    return nullptr;
  }
  if (where_.contains(index)) return loaded;  // another thread was faster
  const auto texels = [](const Texture& texture) {
    return static_cast<std::size_t>(texture.width()) * static_cast<std::size_t>(texture.height());
  };
  kept_.emplace_front(index, loaded);
  where_[index] = kept_.begin();
  kept_texels_ += texels(*loaded);
  while (kept_texels_ > kMaxTexelsKept && kept_.size() > 1) {
    kept_texels_ -= texels(*kept_.back().second);
    where_.erase(kept_.back().first);
    kept_.pop_back();
  }
  return loaded;
}

std::shared_ptr<const Texture> ImageFolder::load(std::size_t index) const {
  const fs::path file = folder_ / files_[index].name;
  check_header(file);
  Image<float> image = load_luminance(file);
  check_size(file, image.width(), image.height());
  return std::make_shared<const Texture>(reduced(std::move(image)), Wrap::clamp, Wrap::clamp);
}

}  // namespace esim::inline dataset

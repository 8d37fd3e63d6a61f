#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "esim/core/error.h"
#include "esim/scene/images/image_file.h"
#include "esim/video/frame_source.h"
#include "esim/video/stamps_file.h"

namespace esim::inline video {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 9> kImageExtensions = {".png", ".jpg", ".jpeg", ".exr", ".hdr",
                                                              ".pgm", ".ppm", ".pnm",  ".webp"};

bool is_image(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return std::find(kImageExtensions.begin(), kImageExtensions.end(), extension) != kImageExtensions.end();
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Natural order: runs of digits compare as numbers, so that frame_10 comes after frame_9.
bool comes_before(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    while (i + 1 < a.size() && a[i] == '0' && is_digit(a[i + 1])) ++i;
    while (j + 1 < b.size() && b[j] == '0' && is_digit(b[j + 1])) ++j;
    std::size_t i_end = i, j_end = j;
    while (i_end < a.size() && is_digit(a[i_end])) ++i_end;
    while (j_end < b.size() && is_digit(b[j_end])) ++j_end;
    if (i_end - i != j_end - j) return i_end - i < j_end - j;
    const int order = a.compare(i, i_end - i, b, j, j_end - j);
    if (order != 0) return order < 0;
    i = i_end, j = j_end;
  }
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

std::vector<std::string> images_of(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    std::error_code error;
    if (entry.is_regular_file(error) && is_image(entry.path())) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end(), comes_before);
  return names;
}

class ImageFolder final : public FrameSource {
 public:
  ImageFolder(const fs::path& folder, Encoding encoding, bool colour)
      : folder_(folder), encoding_(encoding), colour_(colour) {
    std::error_code error;
    if (fs::exists(folder / "images.csv", error)) {
      take(read_images_csv(folder / "images.csv"), "images.csv");
    } else if (fs::exists(folder / "timestamps.txt", error)) {
      take(read_timestamps_txt(folder / "timestamps.txt"), "timestamps.txt");
    } else {
      names_ = images_of(folder);
    }
    listing_.frames = names_.size();
    if (names_.empty()) {
      throw UserError(
          fmt::format("{}: holds no images; put PNG, JPEG, WebP, PGM, PPM, EXR or HDR files there", folder.string()));
    }
  }

  const Listing& listing() const override { return listing_; }

  bool advance() override { return ++next_ <= names_.size(); }

  std::optional<TimeNs> stamp() const override {
    return listing_.stamps.empty() ? std::nullopt : std::optional(listing_.stamps[index()]);
  }

  void read(Planes& planes) override {
    try {
      load_planes(folder_ / names_[index()], encoding_, colour_, planes);
    } catch (const UserError& error) {
      throw UserError(fmt::format("frame {}: {}; replace it, or end before it (duration)", index(), error.what()));
    }
  }

  std::string name() const override { return fmt::format("frame {} ({})", index(), names_[index()]); }

 private:
  std::size_t index() const { return std::min(next_, names_.size()) - 1; }

  void take(const std::vector<StampedName>& entries, const char* file) {
    if (entries.empty()) {
      throw UserError(
          fmt::format("{}: names no frames; list the frames, or remove the file and state the frame rate (fps)",
                      (folder_ / file).string()));
    }
    const bool named = !entries.front().name.empty();
    if (!named) names_ = images_of(folder_);
    if (!named && names_.size() != entries.size()) {
      throw UserError(
          fmt::format("{}: there are {} images but {} time stamps; the numbers must match, or each line must name its "
                      "image",
                      (folder_ / file).string(), names_.size(), entries.size()));
    }
    for (const StampedName& entry : entries) {
      std::error_code error;
      if (named && !fs::exists(folder_ / entry.name, error)) {
        throw UserError(fmt::format("{}: frame {}, {}, is missing; put it there, or remove its line",
                                    (folder_ / file).string(), names_.size(), entry.name));
      }
      if (named) names_.push_back(entry.name);
      listing_.stamps.push_back(entry.t);
    }
  }

  fs::path folder_;
  Encoding encoding_;
  bool colour_;
  Listing listing_;
  std::vector<std::string> names_;
  std::size_t next_ = 0;  // frames that advance() has reached
};

}  // namespace

std::unique_ptr<FrameSource> open_image_folder(const fs::path& folder, Encoding encoding, bool colour) {
  return std::make_unique<ImageFolder>(folder, encoding, colour);
}

}  // namespace esim::inline video

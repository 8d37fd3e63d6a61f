// .sog files (PlayCanvas): images whose pixels are the quantised numbers of the splats, and meta.json, which says how;
// in a ZIP file or in a folder. Version 1 quantises between limits, version 2 by code books.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "esim/core/inputs/used_files.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/files/input_file.h"
#include "esim/files/zip_reader.h"
#include "esim/scene/images/image_header.h"
#include "esim/scene/import/folder.h"
#include "esim/scene/splats/splat_list.h"
#include "esim/scene/splats/splat_readers.h"

namespace esim::inline scene {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::uint64_t kMaxMetaBytes = 1 << 22;
constexpr std::size_t kCodes = 256, kPaletteColumns = 64;
constexpr std::string_view kMeta = "meta.json";

/// The files that make up a .sog.
class SogFiles {
 public:
  virtual ~SogFiles() = default;

  /// Throws UserError if there is no such file, or if it is too large.
  virtual std::vector<std::byte> read(const std::string& name) = 0;
};

class SogZip final : public SogFiles {
 public:
  explicit SogZip(const fs::path& file) : zip_(file), limit_(4 * fs::file_size(file) + 4096) {
    for (const ZipReader::Member& member : zip_.members()) {
      const bool found = member.name == kMeta || member.name.ends_with("/" + std::string(kMeta));
      if (found && (!has_meta_ || member.name.size() < folder_.size() + kMeta.size())) {
        has_meta_ = true;
        folder_ = member.name.substr(0, member.name.size() - kMeta.size());
      }
    }
  }

  bool has_meta() const { return has_meta_; }

  std::vector<std::byte> read(const std::string& name) override {
    for (std::size_t i = 0; i < zip_.members().size(); ++i) {
      if (zip_.members()[i].name == folder_ + name) return read(i, name);
    }
    fail_splats(zip_.path(), fmt::format("the file {} in the zip is missing; export it again", name));
  }

 private:
  /// What the zip states of sizes is not trusted. Images are compressed already, so that they are hardly larger than
  /// the zip.
  std::vector<std::byte> read(std::size_t member, const std::string& name) {
    const Read source = zip_.open(member);
    std::vector<std::byte> bytes;
    for (std::size_t got = 1; got > 0;) {
      const std::size_t before = bytes.size();
      if (before > limit_)
        fail_splats(zip_.path(),
                    fmt::format("is damaged: the file {} in the zip is larger than {} bytes", name, limit_));
      bytes.resize(before + (1 << 16));
      got = source(std::span(bytes).subspan(before));
      bytes.resize(before + got);
    }
    return bytes;
  }

  ZipReader zip_;
  std::uint64_t limit_;
  std::string folder_;  // of meta.json, with a slash at its end
  bool has_meta_ = false;
};

class SogFolder final : public SogFiles {
 public:
  explicit SogFolder(const fs::path& meta) : meta_(meta) {}

  std::vector<std::byte> read(const std::string& name) override {
    if (name == kMeta) return read_bytes(meta_);
    const FolderPath inside = path_inside(meta_.parent_path(), name);
    if (!inside.path)
      fail_splats(meta_, fmt::format("its file '{}' {}; put it next to meta.json", name, inside.reason));
    return read_bytes(*inside.path);
  }

 private:
  fs::path meta_;
};

/// An image of R G B A, of 8 bits each.
struct SogImage {
  ImagePixels pixels;
  std::size_t width() const { return static_cast<std::size_t>(pixels.width); }
  std::size_t height() const { return static_cast<std::size_t>(pixels.height); }
  std::uint8_t at(std::size_t pixel, std::size_t channel) const {
    const auto channels = static_cast<std::size_t>(pixels.channels);
    return channel < channels ? pixels.bytes[pixel * channels + channel] : 255;
  }
};

/// The numbers that bytes stand for.
using Codes = std::array<float, kCodes>;

class SogReader {
 public:
  SogReader(const fs::path& file, SogFiles& files) : file_(file), files_(files) {}

  Splats read(const WarningHandler& warn) {
    const std::vector<std::byte> text = files_.read(std::string(kMeta));
    bytes_ = text.size();
    if (text.size() > kMaxMetaBytes) fail("meta.json is larger than 4 MiB");
    const auto* const begin = reinterpret_cast<const char*>(text.data());
    meta_ = Json::parse(begin, begin + text.size(), nullptr, false);
    if (!meta_.is_object()) fail("meta.json must be a JSON object; export it again");
    read_version();
    read_images();
    return unpack(warn);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const { fail_splats(file_, reason); }

  /// A member of a part of meta.json, such as means.files; null if it is missing.
  const Json& member(const char* part, const char* name) const {
    static const Json kNone;
    const auto found = meta_.find(part);
    if (found == meta_.end() || !found->is_object()) return kNone;
    const auto value = found->find(name);
    return value == found->end() ? kNone : *value;
  }

  std::uint64_t integer(const Json& value, const std::string& what) const {
    if (!value.is_number_unsigned()) fail(fmt::format("meta.json: {} must be an integer from 0", what));
    return value.get<std::uint64_t>();
  }

  float number(const Json& value, const std::string& what) const {
    if (!value.is_number()) fail(fmt::format("meta.json: {} must be a number", what));
    return value.get<float>();
  }

  /// At least `least` numbers.
  std::vector<float> numbers(const char* part, const char* name, std::size_t least) const {
    const Json& value = member(part, name);
    const std::string what = fmt::format("{}.{}", part, name);
    if (!value.is_array() || value.size() < least || value.size() > kCodes)
      fail(fmt::format("meta.json: {} must be a list of {} to {} numbers", what, least, kCodes));
    std::vector<float> result;
    for (const Json& each : value) result.push_back(number(each, what));
    return result;
  }

  void read_version() {
    const Json& version = meta_.contains("version") ? meta_["version"] : Json(1U);
    version_ = integer(version, "version");
    if (version_ != 1 && version_ != 2)
      fail(fmt::format("version of .sog must be 1 or 2, not {}; convert it to one of these", version_));
    if (version_ == 2) {
      count_ = integer(meta_.contains("count") ? meta_["count"] : Json(), "count");
    } else {
      const Json& shape = member("means", "shape");
      count_ = integer(shape.is_array() && !shape.empty() ? shape[0] : Json(), "means.shape");
    }
  }

  /// An image file: the name at the given place of a part's list.
  struct Source {
    const char* part = nullptr;
    std::size_t index = 0;
    SogImage SogReader::*image = nullptr;
    std::uint64_t min_pixels = 0;
    std::string name{};
    std::vector<std::byte> bytes{};
  };

  void read_file(Source& source) {
    const Json& names = member(source.part, "files");
    if (!names.is_array() || names.size() <= source.index || !names[source.index].is_string())
      fail(fmt::format("meta.json: {}.files must have at least {} names", source.part, source.index + 1));
    source.name = names[source.index].get<std::string>();
    source.bytes = files_.read(source.name);
    bytes_ += source.bytes.size();
  }

  /// Decodes an image after checking its size, so that small files do not cause large allocations.
  void decode(const Source& source) {
    constexpr std::uint64_t kMaxPalette = 1 << 20;  // 65536 entries of 15 coefficients
    const std::optional<ImageSize> size = size_in_header(source.bytes);
    SogImage& image = this->*source.image;
    const auto pixels = [](std::int64_t width, std::int64_t height) {
      return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    };
    const bool plausible = size && size->width > 0 && size->width < (1 << 24) && size->height > 0 &&
                           size->height < (1 << 24) && pixels(size->width, size->height) <= 4 * count_ + kMaxPalette;
    if (!plausible || !decode_image(source.bytes, image.pixels) || image.pixels.channels < 3 || image.pixels.bits != 8)
      fail(fmt::format("the image {} is damaged: it must be a lossless WebP; export it again", source.name));
    if (pixels(image.pixels.width, image.pixels.height) < source.min_pixels)
      fail(fmt::format("the image {} must have at least {} pixels, one per splat, not {} x {}; export it again",
                       source.name, source.min_pixels, image.width(), image.height()));
  }

  void read_images() {
    std::vector<Source> sources = {{"means", 0, &SogReader::low_, count_},
                                   {"means", 1, &SogReader::high_, count_},
                                   {"quats", 0, &SogReader::rotations_, count_},
                                   {"scales", 0, &SogReader::deviations_, count_},
                                   {"sh0", 0, &SogReader::colours_, count_}};
    const bool has_palette = meta_.contains("shN") && !meta_["shN"].is_null();
    if (has_palette) {
      sources.push_back({"shN", 0, &SogReader::palette_, 0});
      sources.push_back({"shN", 1, &SogReader::labels_, count_});
    }
    for (Source& source : sources) read_file(source);
    check_splat_count(file_, count_, bytes_);
    for (const Source& source : sources) decode(source);
    if (!has_palette) return;
    // A palette has 64 columns of one pixel per coefficient.
    for (int degree = 1; degree <= kMaxSplatDegree; ++degree) {
      if (palette_.width() == kPaletteColumns * static_cast<std::size_t>(degree * (degree + 2))) degree_ = degree;
    }
    const Json& bands = member("shN", "bands");
    if (degree_ == 0 || (!bands.is_null() && bands != degree_))
      fail(fmt::format("the palette of shN must be 192, 512 or 960 pixels wide, as its degree, not {}; export it again",
                       palette_.width()));
  }

  /// The numbers of a part's bytes: of its code book, or between its limits for the given channel.
  Codes codes(const char* part, std::size_t channel) const {
    Codes codes;
    codes.fill(std::numeric_limits<float>::quiet_NaN());
    if (version_ == 2) {
      const std::vector<float> book = numbers(part, "codebook", 1);
      std::copy(book.begin(), book.end(), codes.begin());
      return codes;
    }
    const bool same = member(part, "mins").is_number();  // for all channels
    const std::string name = part;
    const float low = same ? number(member(part, "mins"), name + ".mins") : numbers(part, "mins", channel + 1)[channel];
    const float high =
        same ? number(member(part, "maxs"), name + ".maxs") : numbers(part, "maxs", channel + 1)[channel];
    for (std::size_t i = 0; i < kCodes; ++i) codes[i] = low + (high - low) * static_cast<float>(i) / 255;
    return codes;
  }

  /// w x y z without its largest component, which the last byte names: 252 for w. The others are from -sqrt(1/2) to
  /// sqrt(1/2). The result is x y z w; zero if it is invalid.
  static Eigen::Vector4f rotation(const SogImage& image, std::size_t pixel) {
    const Eigen::Index largest = Eigen::Index{image.at(pixel, 3)} - 252;
    if (largest < 0) return Eigen::Vector4f::Zero();
    Eigen::Vector4f wxyz;
    float rest = 1;
    std::size_t channel = 0;
    for (Eigen::Index i = 0; i < 4; ++i) {
      if (i == largest) continue;
      wxyz[i] = (static_cast<float>(image.at(pixel, channel++)) / 255 * 2 - 1) / std::numbers::sqrt2_v<float>;
      rest -= wxyz[i] * wxyz[i];
    }
    wxyz[largest] = std::sqrt(std::max(rest, 0.0F));
    return {wxyz[1], wxyz[2], wxyz[3], wxyz[0]};
  }

  Splats unpack(const WarningHandler& warn) {
    SplatList list(file_, degree_, count_, bytes_);
    if (member_is(meta_, "model", "antialiased") || member_is(meta_, "antialias", true))
      list.set_filter(SplatFilter::antialiased);
    const std::vector<float> low = numbers("means", "mins", 3), high = numbers("means", "maxs", 3);
    const std::array<Codes, 3> deviation{codes("scales", 0), codes("scales", 1), codes("scales", 2)};
    const std::array<Codes, 3> colour{codes("sh0", 0), codes("sh0", 1), codes("sh0", 2)};
    const Codes logit = version_ == 1 ? codes("sh0", 3) : Codes{};
    const Codes rest = degree_ > 0 ? codes("shN", 0) : Codes{};
    const std::uint64_t palette_size = degree_ > 0 ? palette_.height() * kPaletteColumns : 0;

    for (std::size_t i = 0; i < count_; ++i) {
      Splat splat;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float t = static_cast<float>(low_.at(i, axis) + 256 * high_.at(i, axis)) / 65535;
        const float folded = low[axis] + (high[axis] - low[axis]) * t;  // sign(x) ln(|x| + 1)
        const auto index = static_cast<Eigen::Index>(axis);
        splat.position[index] = std::copysign(std::expm1(std::abs(folded)), folded);
        splat.deviation[index] = std::exp(deviation[axis][deviations_.at(i, axis)]);
        splat.harmonics[axis] = colour[axis][colours_.at(i, axis)];
      }
      splat.rotation = rotation(rotations_, i);
      const std::uint8_t opacity = colours_.at(i, 3);
      splat.opacity = version_ == 1 ? sigmoid(logit[opacity]) : static_cast<float>(opacity) / 255;
      if (degree_ > 0) {
        const std::size_t label = labels_.at(i, 0) + std::size_t{256} * labels_.at(i, 1);
        if (label >= palette_size)
          fail(fmt::format("splat {}: its entry of the palette of shN must be below {}, not {}; export it again", i,
                           palette_size, label));
        const std::size_t first = label * (list.coefficients() - 1);  // rows of 64 entries, without gaps
        for (std::size_t k = 1; k < list.coefficients(); ++k) {
          for (std::size_t c = 0; c < 3; ++c) splat.harmonics[3 * k + c] = rest[palette_.at(first + k - 1, c)];
        }
      }
      list.add(splat);
    }
    return list.finish(warn);
  }

  static bool member_is(const Json& object, const char* name, const Json& value) {
    const auto found = object.find(name);
    return found != object.end() && *found == value;
  }

  fs::path file_;
  SogFiles& files_;
  Json meta_;
  std::uint64_t version_ = 0, count_ = 0, bytes_ = 0;  // bytes: of all files
  int degree_ = 0;
  SogImage low_, high_;  // bytes of the positions, 16 bits
  SogImage rotations_, deviations_, colours_, palette_, labels_;
};

}  // namespace

Splats read_sog_zip(const fs::path& file, const WarningHandler& warn) {
  note_used(file);
  SogZip zip(file);
  if (!zip.has_meta()) fail_splats(file, "is a zip without the meta.json of a .sog");
  return SogReader(file, zip).read(warn);
}

Splats read_sog_folder(const fs::path& meta, const WarningHandler& warn) {
  SogFolder folder(meta);
  return SogReader(meta, folder).read(warn);
}

bool is_sog_zip(const fs::path& file) { return SogZip(file).has_meta(); }

bool is_sog_meta(std::string_view json) {
  if (json.size() > kMaxMetaBytes) return false;
  const Json meta = Json::parse(json.begin(), json.end(), nullptr, false);
  return meta.is_object() && meta.contains("means") && meta.contains("quats") && meta.contains("sh0");
}

}  // namespace esim::inline scene

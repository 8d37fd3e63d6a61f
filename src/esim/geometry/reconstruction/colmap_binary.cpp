#include <fmt/format.h>

#include <bit>
#include <type_traits>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"
#include "esim/geometry/reconstruction/colmap_models.h"

namespace esim::inline geometry {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian");

/// A file of numbers whose size is known.
class BinaryFile {
 public:
  explicit BinaryFile(const std::filesystem::path& file) : file_(file) {
    std::error_code error;
    size_ = std::filesystem::file_size(file, error);
    if (error || !in_) throw UserError(fmt::format("{}: cannot be read; check its permissions", file.string()));
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw UserError(fmt::format("{}: byte {}: {}", file_.string(), position_, message));
  }

  std::uint64_t remaining() const { return size_ - position_; }

  /// Fails unless the file has so many more bytes.
  void require(std::uint64_t bytes, const std::string& part) const {
    if (bytes > remaining()) {
      fail(fmt::format("the file ends within {}, which needs {} bytes more; copy or export the model again", part,
                       bytes - remaining()));
    }
  }

  template <typename T>
  T read(const std::string& part) {
    static_assert(std::is_trivially_copyable_v<T>);
    require(sizeof(T), part);
    T value{};
    in_.read(reinterpret_cast<char*>(&value), sizeof(T));
    if (!in_) fail("cannot be read; check the disk");
    position_ += sizeof(T);
    return value;
  }

  /// The characters before the next zero byte.
  std::string read_text(const std::string& part) {
    constexpr std::size_t kMaxLength = 4096;
    std::string text;
    while (const char c = read<char>(part)) {
      if (text.size() == kMaxLength) fail(fmt::format("{} is longer than {} characters", part, kMaxLength));
      text += c;
    }
    return text;
  }

  void skip(std::uint64_t bytes, const std::string& part) {
    require(bytes, part);
    in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
    position_ += bytes;
  }

  /// The number of records at the start of the file, each of which has at least so many bytes.
  std::uint64_t read_count(const char* records, std::uint64_t min_bytes) {
    const auto count = read<std::uint64_t>(fmt::format("the number of {}", records));
    if (count > remaining() / min_bytes) {
      fail(fmt::format(
          "{} {} cannot fit into the remaining {} bytes; the file is truncated, or is not a {}.bin of COLMAP", count,
          records, remaining(), records));
    }
    return count;
  }

  void require_end(const char* records) const {
    if (remaining() > 0)
      fail(fmt::format("{} bytes follow after the last of the {}; export the model again", remaining(), records));
  }

 private:
  std::filesystem::path file_;
  std::ifstream in_ = open_input(file_);
  std::uint64_t size_ = 0, position_ = 0;
};

/// Calls body(), and completes its UserErrors with the place.
template <typename Body>
auto at(const BinaryFile& in, const std::string& part, const Body& body) {
  try {
    return body();
  } catch (const UserError& error) {
    in.fail(fmt::format("{}: {}", part, error.what()));
  }
}

}  // namespace

std::vector<ColmapCamera> read_colmap_cameras_binary(const std::filesystem::path& file) {
  BinaryFile in(file);
  constexpr std::uint64_t kMinBytes = 24 + 3 * sizeof(double);
  const std::uint64_t count = in.read_count("cameras", kMinBytes);
  std::vector<ColmapCamera> cameras;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string part = fmt::format("camera {} of {}", i + 1, count);
    ColmapCamera camera;
    camera.id = in.read<std::uint32_t>(part);
    const auto number = in.read<std::int32_t>(part);
    const ColmapModel& model = at(in, part, [&]() -> const ColmapModel& { return colmap_model(number); });
    camera.model = model.name;
    camera.width = static_cast<double>(in.read<std::uint64_t>(part));
    camera.height = static_cast<double>(in.read<std::uint64_t>(part));
    for (std::size_t k = 0; k < model.parameters; ++k) camera.parameters.push_back(in.read<double>(part));
    cameras.push_back(std::move(camera));
  }
  in.require_end("cameras");
  return cameras;
}

std::vector<ColmapImage> read_colmap_images_binary(const std::filesystem::path& file) {
  BinaryFile in(file);
  constexpr std::uint64_t kMinBytes = 4 + 7 * sizeof(double) + 4 + 1 + 8, kPointBytes = 24;
  const std::uint64_t count = in.read_count("images", kMinBytes);
  std::vector<ColmapImage> images;
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string part = fmt::format("image {} of {}", i + 1, count);
    const auto id = in.read<std::uint32_t>(part);
    Eigen::Vector4d q;
    Eigen::Vector3d t;
    for (double& value : q) value = in.read<double>(part);
    for (double& value : t) value = in.read<double>(part);
    const auto camera_id = in.read<std::uint32_t>(part);
    std::string name = in.read_text("the name of " + part);
    images.push_back(at(in, part, [&] { return colmap_image(id, q, t, camera_id, std::move(name)); }));
    const auto points = in.read<std::uint64_t>(part);
    if (points > in.remaining() / kPointBytes) {
      in.fail(fmt::format("{}: {} points cannot fit into the remaining {} bytes; copy or export the model again", part,
                          points, in.remaining()));
    }
    in.skip(points * kPointBytes, part);
  }
  in.require_end("images");
  return images;
}

}  // namespace esim::inline geometry

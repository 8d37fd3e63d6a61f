#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace esim::inline formats::aedat4 {

/// Compression of all packets of a file, in LZ4's or Zstd's frame format. The numbers are those in the file; readers
/// treat `high` like its plain variant.
enum class Packing : std::int32_t { none, lz4, lz4_high, zstd, zstd_high };

/// The name in a file's description: "LZ4".
std::string_view name_of(Packing packing);

class Packer {
 public:
  explicit Packer(Packing packing);
  ~Packer();

  /// Borrowed until the next call.
  std::string_view pack(std::string_view plain);

 private:
  struct Zstd;
  Packing packing_;
  std::unique_ptr<Zstd> zstd_;
  std::string packed_;
};

class Unpacker {
 public:
  /// No program writes larger packets.
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 28;

  explicit Unpacker(Packing packing, std::size_t max_bytes = kMaxBytes);
  ~Unpacker();

  /// Borrowed until the next call, and aligned to 8 bytes. Nothing if the packet is damaged or larger than
  /// `max_bytes`. Memory grows only with the data that exist, whatever size the packet claims.
  std::optional<std::span<const std::byte>> unpack(std::span<const std::byte> packed);

 private:
  struct Contexts;
  Packing packing_;
  std::size_t max_bytes_;
  std::unique_ptr<Contexts> contexts_;
  std::vector<std::byte> plain_;
};

}  // namespace esim::inline formats::aedat4

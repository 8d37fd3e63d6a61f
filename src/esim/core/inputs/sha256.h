#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace esim::inline core {

/// SHA-256 (FIPS 180-4) of bytes that come in parts.
class Sha256 {
 public:
  Sha256();

  void add(std::span<const std::byte> bytes);

  /// The sum of all bytes as 64 hexadecimal digits, as sha256sum prints it. Nothing can be added afterwards.
  std::string finish();

 private:
  static constexpr std::size_t kBlockBytes = 64;
  using State = std::array<std::uint32_t, 8>;

  void (*add_blocks_)(State& state, const std::byte* blocks, std::size_t count);
  State state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::byte, kBlockBytes> rest_{};  // the first rest_size_ bytes wait for a complete block
  std::size_t rest_size_ = 0;
  std::uint64_t bytes_ = 0;
};

/// The sum of a text.
std::string sha256(std::string_view text);

}  // namespace esim::inline core

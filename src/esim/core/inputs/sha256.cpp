#include "esim/core/inputs/sha256.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/inputs/sha256_blocks.h"

namespace esim::inline core {

Sha256::Sha256() : add_blocks_(fastest_sha256_blocks()) {}

void Sha256::add(std::span<const std::byte> bytes) {
  bytes_ += bytes.size();
  if (rest_size_ > 0) {
    const std::size_t taken = std::min(bytes.size(), kBlockBytes - rest_size_);
    std::copy_n(bytes.begin(), taken, rest_.begin() + static_cast<std::ptrdiff_t>(rest_size_));
    rest_size_ += taken;
    bytes = bytes.subspan(taken);
    if (rest_size_ < kBlockBytes) return;
    add_blocks_(state_, rest_.data(), 1);
    rest_size_ = 0;
  }
  const std::size_t complete = bytes.size() / kBlockBytes;
  add_blocks_(state_, bytes.data(), complete);
  bytes = bytes.subspan(complete * kBlockBytes);
  std::copy(bytes.begin(), bytes.end(), rest_.begin());
  rest_size_ = bytes.size();
}

std::string Sha256::finish() {
  const std::uint64_t bits = bytes_ * 8;
  std::array<std::byte, kBlockBytes + 8> padding{std::byte{0x80}};
  const std::size_t zeros = (2 * kBlockBytes - 9 - rest_size_) % kBlockBytes;
  for (std::size_t i = 0; i < 8; ++i) padding[1 + zeros + i] = static_cast<std::byte>(bits >> (56 - 8 * i));
  add(std::span(padding).first(1 + zeros + 8));
  std::string text;
  for (const std::uint32_t word : state_) text += fmt::format("{:08x}", word);
  return text;
}

std::string sha256(std::string_view text) {
  Sha256 sum;
  sum.add(std::as_bytes(std::span(text)));
  return sum.finish();
}

}  // namespace esim::inline core

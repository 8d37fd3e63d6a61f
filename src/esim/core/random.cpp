#include "esim/core/random.h"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

namespace esim {

AddressedRandom::AddressedRandom(std::uint64_t seed, Purpose purpose, std::uint16_t stream)
    : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
      address_{(static_cast<std::uint32_t>(purpose) << 16) | stream} {}

std::array<std::uint32_t, 4> AddressedRandom::bits(std::uint32_t item, std::uint64_t draw) const {
  const r123::Philox4x32::ctr_type counter{
      {item, static_cast<std::uint32_t>(draw), static_cast<std::uint32_t>(draw >> 32), address_}};
  const r123::Philox4x32::key_type key{{key_[0], key_[1]}};
  const auto words = r123::Philox4x32{}(counter, key);
  return {words[0], words[1], words[2], words[3]};
}

std::array<double, 2> AddressedRandom::uniforms(std::uint32_t item, std::uint64_t draw) const {
  const auto words = bits(item, draw);
  const auto open_unit = [](std::uint32_t high, std::uint32_t low) {
    const std::uint64_t word = (static_cast<std::uint64_t>(high) << 32) | low;
    return (static_cast<double>(word >> 11) + 0.5) * 0x1.0p-53;
  };
  return {open_unit(words[0], words[1]), open_unit(words[2], words[3])};
}

std::array<double, 2> AddressedRandom::normals(std::uint32_t item, std::uint64_t draw) const {
  const auto [u, v] = uniforms(item, draw);
  const double radius = std::sqrt(-2.0 * std::log(u));
  const double angle = 2.0 * std::numbers::pi * v;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace esim

#include "esim/core/random.h"

#include <Random123/philox.h>
#include <hwy/highway.h>

#include <cmath>
#include <numbers>

namespace esim::inline core {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::ScalableTag<std::uint32_t>;
using Word = hn::Vec<Words>;

/// The halves of the 64-bit products of 32-bit words.
struct Product {
  Word high, low;
  Product(Word a, std::uint32_t b) {
    const Words d;
    const hn::RepartitionToWide<Words> wide;
    const Word factor = hn::Set(d, b);
    const auto even = hn::MulEven(a, factor);
    const auto odd = hn::MulEven(hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(wide, a))), factor);
    high = hn::OddEven(hn::BitCast(d, odd), hn::BitCast(d, hn::ShiftRight<32>(even)));
    low = hn::OddEven(hn::BitCast(d, hn::ShiftLeft<32>(odd)), hn::BitCast(d, even));
  }
};

}  // namespace

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

void AddressedRandom::bits(std::size_t count, const std::uint32_t* items, const std::uint32_t* draws,
                           const std::array<std::uint32_t*, 4>& words) const {
  // Philox4x32-10 as in the paper: two products per round, and a key that follows a Weyl sequence.
  constexpr int kRounds = 10;
  constexpr std::uint32_t kFactor0 = 0xD2511F53, kFactor1 = 0xCD9E8D57, kWeyl0 = 0x9E3779B9, kWeyl1 = 0xBB67AE85;
  static_assert(hn::MaxLanes(Words()) <= 16);
  const Words d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    Word c0 = hn::LoadU(d, items + i), c1 = hn::LoadU(d, draws + i), c2 = hn::Zero(d), c3 = hn::Set(d, address_);
    auto [key0, key1] = key_;
    for (int round = 0; round < kRounds; ++round, key0 += kWeyl0, key1 += kWeyl1) {
      const Product p0(c0, kFactor0), p1(c2, kFactor1);
      c0 = hn::Xor(hn::Xor(p1.high, c1), hn::Set(d, key0));
      c2 = hn::Xor(hn::Xor(p0.high, c3), hn::Set(d, key1));
      c1 = p1.low;
      c3 = p0.low;
    }
    hn::StoreU(c0, d, words[0] + i);
    hn::StoreU(c1, d, words[1] + i);
    hn::StoreU(c2, d, words[2] + i);
    hn::StoreU(c3, d, words[3] + i);
  }
}

std::array<double, 2> AddressedRandom::uniforms(std::uint32_t item, std::uint64_t draw) const {
  const auto words = bits(item, draw);
  return {open_unit(words[0], words[1]), open_unit(words[2], words[3])};
}

std::array<double, 2> AddressedRandom::normals(std::uint32_t item, std::uint64_t draw) const {
  const auto [u, v] = uniforms(item, draw);
  const double radius = std::sqrt(-2.0 * std::log(u));
  const double angle = 2.0 * std::numbers::pi * v;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace esim::inline core

#include "esim/sensors/event_normals.h"

#include "esim/sensors/vector_math.h"

namespace esim {
namespace {

/// Two normal deviates from two words.
template <class D, class Words>
void box_muller(D d, Words word0, Words word1, hn::Vec<D>& normal0, hn::Vec<D>& normal1) {
  const hn::RebindToSigned<D> di;
  const auto open_unit = [&](auto word) {  // on (0, 1), 24 bits
    const auto whole = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(word)));
    return hn::Mul(hn::Add(whole, hn::Set(d, 0.5F)), hn::Set(d, 0x1.0p-24F));
  };
  const auto radius = hn::Sqrt(hn::Mul(hn::Set(d, -2.0F), hn::Log(d, open_unit(word0))));
  const auto angle = hn::Mul(hn::Set(d, 6.2831853F), open_unit(word1));
  normal0 = hn::Mul(radius, hn::Cos(d, angle));
  normal1 = hn::Mul(radius, hn::Sin(d, angle));
}

}  // namespace

void EventNormals::draw(const AddressedRandom& random, std::span<const Address> addresses) {
  const std::size_t count = addresses.size();
  if (words_[0].size() < count + kVectorPadding) {
    for (auto& words : words_) words.resize(2 * count + kVectorPadding);
    normals_.resize(kPerEvent * (2 * count + kVectorPadding));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = random.bits(addresses[i].pixel, addresses[i].draw);
    for (std::size_t k = 0; k < kPerEvent; ++k) words_[k][i] = bits[k];
  }
  const hn::ScalableTag<float> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    hn::Vec<decltype(d)> n0, n1, n2, n3;
    box_muller(d, hn::LoadU(du, &words_[0][i]), hn::LoadU(du, &words_[1][i]), n0, n1);
    box_muller(d, hn::LoadU(du, &words_[2][i]), hn::LoadU(du, &words_[3][i]), n2, n3);
    hn::StoreInterleaved4(n0, n1, n2, n3, d, &normals_[kPerEvent * i]);
  }
}

}  // namespace esim

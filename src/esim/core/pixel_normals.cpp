#include "esim/core/pixel_normals.h"

#include "esim/core/vector_math.h"

namespace esim::inline core {
namespace {

/// Two normal deviates from two words.
template <class D, class Words>
void box_muller(D d, Words word0, Words word1, hn::Vec<D>& normal0, hn::Vec<D>& normal1) {
  const hn::RebindToSigned<D> di;
  const auto open_unit = [&](auto word) {  // on (0, 1), 24 bits
    const auto whole = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(word)));
    return hn::Mul(hn::Add(whole, hn::Set(d, 0.5F)), hn::Set(d, 0x1.0p-24F));
  };
  const auto radius = hn::Sqrt(hn::Mul(hn::Set(d, -2.0F), logarithm(d, open_unit(word0))));
  hn::Vec<D> cosine, sine;
  cosine_and_sine(d, open_unit(word1), cosine, sine);
  normal0 = hn::Mul(radius, cosine);
  normal1 = hn::Mul(radius, sine);
}

}  // namespace

void PixelNormals::draw(const AddressedRandom& random, std::size_t count, const PerPixel<std::uint32_t>& pixel,
                        const PerPixel<std::uint32_t>& draws) {
  random.bits(count, pixel.data(), draws.data(),
              {words_[0].data(), words_[1].data(), words_[2].data(), words_[3].data()});
  const hn::ScalableTag<float> d;
  const hn::RebindToUnsigned<decltype(d)> du;
  for (std::size_t pair = 0; pair < 4; pair += 2) {
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
      hn::Vec<decltype(d)> normal0, normal1;
      box_muller(d, hn::LoadU(du, &words_[pair][i]), hn::LoadU(du, &words_[pair + 1][i]), normal0, normal1);
      hn::StoreU(normal0, d, &normals_[pair][i]);
      hn::StoreU(normal1, d, &normals_[pair + 1][i]);
    }
  }
}

}  // namespace esim::inline core

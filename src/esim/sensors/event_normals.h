#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/random.h"

namespace esim {

/// Four standard normal deviates for each of many pixels' next events, computed together: Box-Muller on the 32-bit
/// words of AddressedRandom::bits(pixel, draw), in floats. Those of a pixel do not depend on the others.
class EventNormals {
 public:
  static constexpr std::size_t kPerEvent = 4;

  /// What is drawn for: the pixel, and how many draws it has had before.
  struct Address {
    std::uint32_t pixel, draw;
  };
  void draw(const AddressedRandom& random, std::span<const Address> addresses);

  /// Those of the i-th address.
  const float* of(std::size_t i) const { return &normals_[kPerEvent * i]; }

 private:
  std::array<std::vector<std::uint32_t>, kPerEvent> words_;
  std::vector<float> normals_;
};

}  // namespace esim

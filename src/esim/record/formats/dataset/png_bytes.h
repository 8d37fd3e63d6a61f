#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "esim/core/image.h"

namespace esim {

struct GreyPng {
  int bits = 8;  ///< 8 or 16
  Image<std::uint16_t> image{};
};

/// A grey PNG of 8 or 16 bits, compressed a little and fast.
std::string encode_png(const Image<std::uint16_t>& image, int bits);

/// Colours become grey. Nothing where it is no PNG, damaged, or claims to be larger than its bytes can tell of.
std::optional<GreyPng> decode_png(std::string_view bytes);

}  // namespace esim

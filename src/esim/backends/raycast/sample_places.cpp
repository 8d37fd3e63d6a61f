#include "esim/backends/raycast/sample_places.h"

#include <fmt/format.h>

#include "esim/core/error.h"

namespace esim::inline backends::inline raycast {

std::vector<Eigen::Vector2f> sample_places(int samples_per_pixel) {
  const int count = samples_per_pixel;
  if (count != 1 && count != 16 && count != 64)
    throw UserError(fmt::format("samples_per_pixel: {} is not supported; use 1, 16 or 64", count));
  const int generator = count == 64 ? 19 : 5;
  const auto place = [count](int k) {
    return (static_cast<float>(k % count) + 0.5F) / static_cast<float>(count) - 0.5F;
  };
  std::vector<Eigen::Vector2f> places;
  for (int i = 0; i < count; ++i) places.emplace_back(place(i), place(generator * i));
  return places;
}

}  // namespace esim::inline backends::inline raycast

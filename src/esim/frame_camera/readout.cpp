#include "esim/frame_camera/readout.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace esim::inline frame_camera {
namespace {

constexpr float kManyElectrons = 64;

/// Sums the probabilities: the smallest k whose distribution function reaches that of the normal deviate.
float few_electrons(double mean, double normal) {
  const double reached = 0.5 * std::erfc(-normal / std::numbers::sqrt2);
  double probability = std::exp(-mean), sum = probability, k = 0;
  while (sum < reached && (k < mean || probability > 1e-18)) {
    ++k;
    probability *= mean / k;
    sum += probability;
  }
  return static_cast<float>(k);
}

}  // namespace

float poisson(float mean, float normal) {
  if (!(mean > 0)) return 0;
  if (mean < kManyElectrons) return few_electrons(static_cast<double>(mean), static_cast<double>(normal));
  // Cornish-Fisher expansion of the quantile: its error is far below one electron.
  const float root = std::sqrt(mean), square = normal * normal;
  const float quantile = mean + root * normal + (square - 1) / 6 + (normal - normal * square) / (72 * root);
  return std::max(0.0F, std::floor(quantile + 0.5F));
}

/// A block of pixels that are read together.
struct FrameReadout::Block {
  std::size_t count = 0;
  PerPixel<float> signal{};
  PerPixel<std::uint32_t> pixel{}, draw{};
  PixelNormals normals{};
};

FrameReadout::FrameReadout(const FrameCameraOptions& options, std::uint64_t seed, std::uint16_t stream)
    : options_(options), response_(options.response), random_(seed, Purpose::frame_noise, stream) {}

/// Reads the pixels from index `first` on.
void FrameReadout::read_block(Block& block, std::size_t first, std::uint32_t number, double electrons_per_irradiance,
                              const float* irradiance, std::uint16_t* numbers) const {
  const auto scale = static_cast<float>(electrons_per_irradiance), well = static_cast<float>(options_.full_well_e);
  const auto read_noise = static_cast<float>(options_.read_noise_e);
  float* const signal = block.signal.data();
  const std::size_t count = block.count;
  if (options_.shot_noise || read_noise > 0) {
    std::iota(block.pixel.begin(), block.pixel.begin() + count, static_cast<std::uint32_t>(first));
    std::fill_n(block.draw.begin(), count, number);
    block.normals.draw(random_, count, block.pixel, block.draw);
  }

  // Electrons: collected, limited by the full well, read.
  const float max = 2 * well + 1000;  // above this the well is always full
  for (std::size_t i = 0; i < count; ++i) signal[i] = std::min(irradiance[i] * scale, max);
  if (options_.shot_noise) {
    for (std::size_t i = 0; i < count; ++i) signal[i] = poisson(signal[i], block.normals[0][i]);
  }
  for (std::size_t i = 0; i < count; ++i) signal[i] = std::min(signal[i], well);
  if (read_noise > 0) {
    for (std::size_t i = 0; i < count; ++i) signal[i] += read_noise * block.normals[1][i];
  }

  // Levels and digital numbers.
  const auto per_electron = static_cast<float>(options_.gain / options_.full_well_e);
  for (std::size_t i = 0; i < count; ++i) signal[i] = std::min(signal[i] * per_electron, 1.0F);
  response_.apply({signal, count});
  const auto largest = static_cast<float>(options_.largest_number()), black = static_cast<float>(options_.black_level);
  const float range = largest - black;
  for (std::size_t i = 0; i < count; ++i) {
    const float value = std::clamp(black + range * signal[i], 0.0F, largest);
    numbers[i] = static_cast<std::uint16_t>(value + 0.5F);
  }
}

void FrameReadout::read(const Image<float>& irradiance, double exposure, std::int64_t number, const Workers& workers,
                        Image<std::uint16_t>& numbers) const {
  constexpr std::size_t kBlocksPerPiece = 32;
  const double electrons_per_irradiance = options_.full_well_e / options_.saturation_irradiance * exposure;
  const std::size_t pixels = irradiance.size(), piece = kBlock * kBlocksPerPiece;
  workers.for_each(static_cast<int>((pixels + piece - 1) / piece), [&](int i) {
    Block block;
    const std::size_t begin = static_cast<std::size_t>(i) * piece, end = std::min(begin + piece, pixels);
    for (std::size_t first = begin; first < end; first += kBlock) {
      block.count = std::min(kBlock, end - first);
      read_block(block, first, static_cast<std::uint32_t>(number), electrons_per_irradiance, irradiance.data() + first,
                 numbers.data() + first);
    }
  });
}

double FrameReadout::mean_level(const Image<std::uint16_t>& numbers) const {
  const auto pixels = numbers.pixels();
  const std::uint64_t sum = std::accumulate(pixels.begin(), pixels.end(), std::uint64_t{0});
  const double mean = static_cast<double>(sum) / static_cast<double>(pixels.size());
  return std::max(0.0, (mean - options_.black_level) / (options_.largest_number() - options_.black_level));
}

}  // namespace esim::inline frame_camera

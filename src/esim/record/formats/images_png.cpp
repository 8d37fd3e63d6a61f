#include "esim/record/formats/images_png.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "esim/record/formats/png_file.h"

namespace esim {
namespace {

double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double linear_from_srgb(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

// Irradiance at which level i + 1 is nearer than level i.
std::array<float, 255> level_bounds() {
  std::array<float, 255> bounds;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    bounds[i] = static_cast<float>(linear_from_srgb((static_cast<double>(i) + 0.5) / 255.0));
  }
  return bounds;
}

// Level at the start of each 4096th of [0, 1]: from there the exact one is at most a few bounds away.
std::array<std::uint8_t, 4097> level_starts() {
  std::array<std::uint8_t, 4097> starts;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    starts[i] = static_cast<std::uint8_t>(std::floor(255.0 * srgb_from_linear(static_cast<double>(i) / 4096.0)));
  }
  return starts;
}

}  // namespace

Image<std::uint8_t> encode_srgb(const Image<float>& irradiance) {
  static const auto kBounds = level_bounds();
  static const auto kStarts = level_starts();
  Image<std::uint8_t> encoded(irradiance.width(), irradiance.height());
  std::transform(irradiance.pixels().begin(), irradiance.pixels().end(), encoded.pixels().begin(), [](float e) {
    if (!(e > 0.0f)) return std::uint8_t{0};
    if (e >= 1.0f) return std::uint8_t{255};
    std::size_t level = kStarts[static_cast<std::size_t>(e * 4096.0f)];
    while (level < 255 && e >= kBounds[level]) ++level;
    return static_cast<std::uint8_t>(level);
  });
  return encoded;
}

Image<float> decode_srgb(const Image<std::uint16_t>& encoded, int bits) {
  const double full_scale = static_cast<double>((1 << bits) - 1);
  std::vector<float> levels(std::size_t{1} << bits);
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] = static_cast<float>(linear_from_srgb(static_cast<double>(i) / full_scale));
  Image<float> irradiance(encoded.width(), encoded.height());
  std::transform(encoded.pixels().begin(), encoded.pixels().end(), irradiance.pixels().begin(),
                 [&](std::uint16_t level) { return levels[level]; });
  return irradiance;
}

void ImagesPngWriter::begin(const RecordingInfo&) { files_.emplace(folder_, ".png"); }

void ImagesPngWriter::write(const Record& record) {
  if (const auto* image = std::get_if<ImageRecord>(&record); image != nullptr && image->camera == camera_) {
    from_images_ = true;
    write(image->t, image->irradiance);
  }
  const auto* truth = std::get_if<TruthRecord>(&record);
  if (truth != nullptr && truth->camera == camera_ && !from_images_) write(truth->t, truth->irradiance);
}

void ImagesPngWriter::write(TimeNs t, const Image<float>& irradiance) {
  write_png(files_->next_path(), encode_srgb(irradiance));
  files_->add(t);
}

void ImagesPngWriter::end(bool) {
  if (files_) files_->close();
  files_.reset();
}

}  // namespace esim

#include "esim/record/formats/images_png.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esim/record/formats/png_file.h"
#include "esim/record/number_text.h"

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

void ImagesPngWriter::begin(const RecordingInfo&) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw_cannot_write(folder_, error.message());
  timestamps_.emplace(folder_ / "timestamps.txt");
  timestamps_->append("# index t_s file\n");
}

void ImagesPngWriter::write(const Record& record) {
  const auto* truth = std::get_if<TruthRecord>(&record);
  if (truth == nullptr || truth->camera != camera_) return;

  const std::string name = fmt::format("{:06}.png", count_);
  write_png(folder_ / name, encode_srgb(truth->irradiance));

  std::string& line = timestamps_->buffer();
  fmt::format_to(std::back_inserter(line), "{} ", count_);
  append_seconds(line, truth->t);
  line += " " + name + "\n";
  timestamps_->flush();
  ++count_;
}

void ImagesPngWriter::end(bool) {
  if (timestamps_) timestamps_->close();
  timestamps_.reset();
}

}  // namespace esim

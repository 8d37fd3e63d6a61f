#include "esim/fit/image_stream.h"

#include <algorithm>
#include <variant>

#include "esim/formats/formats.h"

namespace esim::inline fit {

ImageStream::ImageStream(const std::filesystem::path& path, const ReadOptions& options)
    : source_(open_source(path, options)) {}

bool ImageStream::next() {
  while (const Record* record = source_->next()) {
    if (kind_ != std::variant_npos && record->index() != kind_) continue;
    if (!take(*record)) continue;
    kind_ = record->index();
    return true;
  }
  return false;
}

bool ImageStream::take(const Record& record) {
  const auto copy = [&](int camera, TimeNs t, const Image<float>& image) {
    if (camera != 0 || image.empty()) return false;
    time_ = t, image_ = image;
    return true;
  };
  if (const auto* image = std::get_if<ImageRecord>(&record)) return copy(image->camera, image->t, image->irradiance);
  if (const auto* truth = std::get_if<TruthRecord>(&record)) return copy(truth->camera, truth->t, truth->irradiance);
  const auto* const frame = std::get_if<FrameRecord>(&record);
  if (frame == nullptr || frame->camera != 0 || frame->image.empty()) return false;
  time_ = frame->t;
  image_ = Image<float>(frame->image.width(), frame->image.height());
  const double per_number = 1 / (frame->gain * std::max(1e-9, to_seconds(frame->exposure_duration)));
  const int saturated = (1 << frame->bits) - 1;
  std::transform(
      frame->image.pixels().begin(), frame->image.pixels().end(), image_.pixels().begin(),
      [&](std::uint16_t number) { return number >= saturated ? 0.0F : static_cast<float>(per_number * number); });
  return true;
}

}  // namespace esim::inline fit

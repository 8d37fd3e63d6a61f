#include "esim/evaluate/reference_brightness.h"

#include <algorithm>
#include <cmath>

namespace esim::inline evaluate {

ReferenceBrightness::ReferenceBrightness(const World& world, std::vector<PixelPosition> pixels, double rate_hz,
                                         double log_eps, std::size_t memory_bytes)
    : world_(world), pixels_(std::move(pixels)), rate_hz_(rate_hz), log_eps_(log_eps) {
  const Camera& model = world.info.cameras[0].model;
  const Tile image{0, 0, model.width, model.height};
  if (pixels_.size() == image.area()) {
    tiles_ = {image};
  } else {
    for (const PixelPosition& p : pixels_) tiles_.push_back({p.x, p.y, 1, 1});
  }
  instants_ = static_cast<std::int64_t>(to_seconds(world.info.end - world.info.start) * rate_hz) + 2;
  while (instants_ > 1 && time(instants_ - 1) > world.info.end) --instants_;
  const std::size_t block_bytes = pixels_.size() * kBlock * (sizeof(float) + sizeof(Place));
  capacity_ = std::max<std::size_t>(2, memory_bytes / block_bytes);
}

std::int64_t ReferenceBrightness::first_after(TimeNs t) const {
  auto k = static_cast<std::int64_t>(to_seconds(t - world_.info.start) * rate_hz_);
  while (k > 0 && time(k - 1) > t) --k;
  while (k < instants_ && time(k) <= t) ++k;
  return k;
}

const Image<float>& ReferenceBrightness::block(std::int64_t block) { return entry(block).brightness; }

const Image<Place>& ReferenceBrightness::places(std::int64_t block) { return entry(block).places; }

ReferenceBrightness::Entry& ReferenceBrightness::entry(std::int64_t block) {
  Entry& entry = kept_[block];
  entry.used = ++clock_;
  if (!entry.brightness.empty()) return entry;
  if (kept_.size() > capacity_) {
    const auto oldest = std::min_element(kept_.begin(), kept_.end(),
                                         [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
    std::swap(entry.brightness, oldest->second.brightness);
    std::swap(entry.places, oldest->second.places);
    kept_.erase(oldest);
  }
  render(block, entry);
  return entry;
}

void ReferenceBrightness::render(std::int64_t block, Entry& entry) {
  const Camera& model = world_.info.cameras[0].model;
  const bool whole = tiles_[0].area() == pixels_.size();
  Image<float>& brightness = entry.brightness;
  if (brightness.empty()) brightness = Image<float>(kBlock, static_cast<int>(pixels_.size()));
  if (whole && entry.places.empty()) entry.places = Image<Place>(kBlock, static_cast<int>(pixels_.size()));
  const std::int64_t first = block * kBlock, count = std::min(kBlock, instants_ - first);
  for (std::int64_t j = 0; j < count; ++j) {
    world_.cameras[0].renderer->render(view(world_, 0, time(first + j), tiles_), sample_);
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const double irradiance = sample_.irradiance(pixels_[i].x, pixels_[i].y);
      brightness(static_cast<int>(j), static_cast<int>(i)) = static_cast<float>(std::log(irradiance + log_eps_));
    }
    if (!whole) continue;
    const Image<Place> places = places_of(sample_.depth, std::sqrt(model.fx * model.fy));
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      entry.places(static_cast<int>(j), static_cast<int>(i)) = places(pixels_[i].x, pixels_[i].y);
  }
}

}  // namespace esim::inline evaluate

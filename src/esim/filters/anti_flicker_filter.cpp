#include "esim/filters/anti_flicker_filter.h"

#include <cmath>
#include <cstddef>

#include "esim/filters/windows.h"

namespace esim::inline filters {
namespace {

constexpr std::uint8_t kMaxCounter = 7;

std::size_t blocks(int pixels) {
  return static_cast<std::size_t>((pixels + AntiFlickerFilter::kBlock_px - 1) / AntiFlickerFilter::kBlock_px);
}

}  // namespace

AntiFlickerFilter::AntiFlickerFilter(const AntiFlickerOptions& options, int width, int height)
    : mode_(options.mode),
      shortest_(static_cast<std::int64_t>(std::floor(1e9 / options.high_hz / static_cast<double>(kTick)))),
      longest_(static_cast<std::int64_t>(std::ceil(1e9 / options.low_hz / static_cast<double>(kTick)))),
      start_(options.start_threshold),
      stop_(options.stop_threshold),
      columns_(blocks(width)),
      blocks_(columns_ * blocks(height)) {}

void AntiFlickerFilter::see_rise(Block& block, std::int64_t now) const {
  const std::int64_t period = now - block.rise;
  const bool in_band = block.has_risen && period >= shortest_ && period <= longest_;
  if (in_band) {
    if (block.counter < kMaxCounter) ++block.counter;
  } else if (block.counter > 0) {
    --block.counter;
  }
  block.rise = now;
  block.has_risen = true;
  if (block.counter >= start_) block.flickers = true;
  if (block.counter <= stop_) block.flickers = false;
}

void AntiFlickerFilter::process(EventSpan events, std::vector<Event>& out) {
  for (const Event& event : events) {
    Block& block = blocks_[event.y / kBlock_px * columns_ + event.x / kBlock_px];
    const std::int64_t now = window_index(event.t, kTick);
    if (block.has_risen && now - block.rise > longest_) block.counter = 0, block.has_risen = block.flickers = false;
    if (block.polarity < 0 && event.polarity > 0) see_rise(block, now);
    block.polarity = event.polarity;
    if (block.flickers == (mode_ == FlickerMode::band_pass)) out.push_back(event);
  }
}

}  // namespace esim::inline filters

#include "esim/represent/representations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline represent {
namespace {

constexpr TimeNs kNever = std::numeric_limits<TimeNs>::min();

template <typename T>
ImageStack<T> make_stack(int count, int width, int height, T value = T{}) {
  constexpr int kMaxExtent = 65536, kMaxCount = 65536;
  if (std::min(width, height) < 1 || std::max(width, height) > kMaxExtent) {
    throw UserError("the size of the sensor is invalid, " + std::to_string(width) + " x " + std::to_string(height) +
                    " px; width and height must be between 1 and " + std::to_string(kMaxExtent));
  }
  if (count < 1 || count > kMaxCount)
    throw UserError(std::to_string(count) + " bins: the number must be between 1 and " + std::to_string(kMaxCount));
  ImageStack<T> stack{count, height, width, {}};
  stack.values.assign(
      static_cast<std::size_t>(count) * static_cast<std::size_t>(height) * static_cast<std::size_t>(width), value);
  return stack;
}

[[noreturn]] void refuse(EventSpan events, const Event& event, int width, int height) {
  throw UserError("event " + std::to_string(&event - events.data()) + ": x = " + std::to_string(event.x) +
                  ", y = " + std::to_string(event.y) + " is outside the sensor, " + std::to_string(width) + " x " +
                  std::to_string(height) + " px");
}

/// Calls visit(event, pixel) for each event.
template <typename Visit>
void for_each_pixel(EventSpan events, int width, int height, Visit visit) {
  for (const Event& event : events) {
    if (event.x >= width || event.y >= height) [[unlikely]]
      refuse(events, event, width, height);
    visit(event, static_cast<std::size_t>(event.y) * static_cast<std::size_t>(width) + event.x);
  }
}

bool covers(const TimeSpan& span, TimeNs t) { return t >= span.start && t <= span.end; }

/// Factor that scales the time since the start of a span to [0, full].
double scale_of(const TimeSpan& span, double full) {
  if (span.end < span.start) {
    throw UserError("the time span from " + std::to_string(span.start) + " to " + std::to_string(span.end) +
                    " ns ends before it starts");
  }
  return span.end > span.start ? full / (static_cast<double>(span.end) - static_cast<double>(span.start)) : 0.0;
}

}  // namespace

ImageStack<std::int32_t> count_events(EventSpan events, int width, int height) {
  auto stack = make_stack<std::int32_t>(2, width, height);
  const std::size_t plane = stack.values.size() / 2;
  for_each_pixel(events, width, height, [&](const Event& event, std::size_t pixel) {
    ++stack.values[pixel + (event.polarity > 0 ? 0 : plane)];
  });
  return stack;
}

ImageStack<float> count_and_stamp(EventSpan events, int width, int height, const TimeSpan& span, StampChoice stamp) {
  auto stack = make_stack<float>(4, width, height);
  const std::size_t plane = stack.values.size() / 4;
  const double scale = scale_of(span, 1);
  std::vector<double> stamps(2 * plane, 0.0);  // last time stamp, or their sum
  for_each_pixel(events, width, height, [&](const Event& event, std::size_t pixel) {
    if (!covers(span, event.t)) return;
    const std::size_t place = pixel + (event.polarity > 0 ? 0 : plane);
    const double time = scale * static_cast<double>(event.t - span.start);
    stack.values[place] += 1;
    stamps[place] = stamp == StampChoice::last ? std::max(stamps[place], time) : stamps[place] + time;
  });
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const double events_here = stamp == StampChoice::last ? 1.0 : std::max(1.0F, stack.values[i]);
    stack.values[2 * plane + i] = static_cast<float>(stamps[i] / events_here);
  }
  return stack;
}

ImageStack<float> voxel_grid(EventSpan events, int width, int height, int bins, const TimeSpan& span) {
  auto stack = make_stack<float>(bins, width, height);
  const std::size_t plane = stack.values.size() / static_cast<std::size_t>(bins);
  const double scale = scale_of(span, bins - 1);
  for_each_pixel(events, width, height, [&](const Event& event, std::size_t pixel) {
    if (!covers(span, event.t)) return;
    const double position = scale * static_cast<double>(event.t - span.start);
    const int bin = std::min(static_cast<int>(position), bins - 1);
    const auto beyond = static_cast<float>(position - bin);
    const auto polarity = static_cast<float>(event.polarity > 0 ? 1 : -1);
    float* const here = stack.values.data() + static_cast<std::size_t>(bin) * plane + pixel;
    *here += polarity * (1 - beyond);
    if (bin + 1 < bins) here[plane] += polarity * beyond;
  });
  return stack;
}

void standardise(std::span<float> values) {
  double count = 0, sum = 0, squares = 0;
  for (const float value : values) count += value != 0 ? 1 : 0, sum += value;
  if (count == 0) return;
  const double mean = sum / count;
  for (const float value : values) squares += value != 0 ? (value - mean) * (value - mean) : 0;
  const double deviation = std::sqrt(squares / count);
  for (float& value : values) {
    if (value != 0) value = deviation > 0 ? static_cast<float>((value - mean) / deviation) : 0;
  }
}

ImageStack<float> time_surface(EventSpan events, int width, int height, TimeNs t, double tau_s) {
  if (!(tau_s > 0 && std::isfinite(tau_s)))
    throw UserError("tau must be above 0 s and finite, not " + std::to_string(tau_s) + " s");
  auto stack = make_stack<float>(2, width, height);
  const std::size_t plane = stack.values.size() / 2;
  std::vector<TimeNs> last(2 * plane, kNever);
  for_each_pixel(events, width, height, [&](const Event& event, std::size_t pixel) {
    if (event.t > t) return;
    TimeNs& newest = last[pixel + (event.polarity > 0 ? 0 : plane)];
    newest = std::max(newest, event.t);
  });
  const double rate = -1e-9 / tau_s;
  for (std::size_t i = 0; i < last.size(); ++i) {
    if (last[i] != kNever) stack.values[i] = static_cast<float>(std::exp(rate * static_cast<double>(t - last[i])));
  }
  return stack;
}

std::vector<std::uint8_t> event_frame(EventSpan events, int width, int height, const FramePalette& palette) {
  ImageStack<std::uint8_t> frame = make_stack<std::uint8_t>(3, width, height);
  for (std::size_t i = 0; i < frame.values.size(); i += 3)
    std::copy_n(palette.background.data(), 3, frame.values.data() + i);
  for_each_pixel(events, width, height, [&](const Event& event, std::size_t pixel) {
    std::copy_n((event.polarity > 0 ? palette.on : palette.off).data(), 3, frame.values.data() + 3 * pixel);
  });
  return std::move(frame.values);
}

}  // namespace esim::inline represent

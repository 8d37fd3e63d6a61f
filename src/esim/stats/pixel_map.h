#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/recording/format.h"

namespace esim::inline stats {

/// One value per pixel of a sensor. If the size of the sensor is not given, the map grows with the events.
template <class T>
class PixelMap {
 public:
  static constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;

  /// Throws UserError if the sensor has more than 2^26 pixels.
  explicit PixelMap(std::optional<SensorSize> size) : grows_(!size) {
    if (!size) return;
    require_bearable(size->width, size->height);
    size_ = *size;
    pixels_ = Image<T>(size->width, size->height);
  }

  /// The value of the event's pixel. Throws InternalError if the event is outside a sensor of given size, and UserError
  /// if the sensor becomes too large.
  T& operator()(const Event& event) {
    if (event.x >= size_.width || event.y >= size_.height) make_room(event);
    return pixels_(event.x, event.y);
  }

  SensorSize size() const { return size_; }  ///< as given, or just large enough for the events
  const T& at(int x, int y) const { return pixels_(x, y); }

 private:
  static void require_bearable(std::int64_t width, std::int64_t height) {
    if (width * height <= kMaxPixels) return;
    throw UserError("a sensor of " + std::to_string(width) + " x " + std::to_string(height) +
                    " px is too large for statistics, which support at most " + std::to_string(kMaxPixels >> 20) +
                    " million pixels; check the coordinates of the events");
  }

  void make_room(const Event& event) {
    if (!grows_) throw InternalError("an event is outside the sensor");
    size_.width = std::max(size_.width, event.x + 1);
    size_.height = std::max(size_.height, event.y + 1);
    if (event.x < pixels_.width() && event.y < pixels_.height()) return;
    require_bearable(size_.width, size_.height);
    Image<T> larger(std::max(size_.width, pixels_.width() * 3 / 2), std::max(size_.height, pixels_.height() * 3 / 2));
    for (int y = 0; y < pixels_.height(); ++y) std::copy_n(pixels_.row(y), pixels_.width(), larger.row(y));
    pixels_ = std::move(larger);
  }

  bool grows_;
  SensorSize size_;
  Image<T> pixels_;
};

}  // namespace esim::inline stats

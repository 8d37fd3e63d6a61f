#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

// Pixels on their way through a segment, many at once. Private to the event camera.
namespace esim {

/// Arrays that are worked on in whole vectors have room for one more.
inline constexpr std::size_t kVectorPadding = 16;

/// Pixels that go through a segment together: enough for vectors, few enough for the first level of cache.
inline constexpr std::size_t kBlock = 256;

template <typename T>
using PerPixel = std::array<T, kBlock + kVectorPadding>;

/// The pixels of a segment that woke up. What is not in use of the low-pass holds any number.
struct AwakePixels {
  PerPixel<std::uint32_t> pixel, place;  ///< index; EventPacking::place()
  PerPixel<float> light0, light1;        ///< irradiance at the segment's ends
  PerPixel<float> start, end;            ///< brightness there
  PerPixel<float> filtered1, filtered2;  ///< behind each pole, at the segment's start
  PerPixel<float> phase, moved;          ///< time constants that the segment lasts, and 1 - exp(-phase)
  std::size_t count = 0;

  void copy(std::size_t i, std::size_t to) {
    pixel[to] = pixel[i], place[to] = place[i];
    for (auto* values : {&light0, &light1, &start, &end, &filtered1, &filtered2, &phase, &moved})
      (*values)[to] = (*values)[i];
  }
};

/// What the pixels of a block compare their signals with, and what comes of it. Times are ns after the segment's start.
/// The signal is G less what had leaked until then: F(tau) + leak tau, F being the brightness behind the low-pass.
struct Comparators {
  double threshold_on = 0, threshold_off = 0;
  PerPixel<float> on, off;  ///< what the pixel's thresholds are above these two
  PerPixel<double> reference;
  PerPixel<double> leak;      ///< 1/ns
  PerPixel<double> from;      ///< what lies before is done
  PerPixel<double> tau;       ///< when the signal first leaves the levels,
  PerPixel<double> polarity;  ///< through which: 1, -1, or 0 where it does not
  std::size_t count = 0;

  double upper(std::size_t i) const { return reference[i] + (threshold_on + static_cast<double>(on[i])); }
  double lower(std::size_t i) const { return reference[i] - (threshold_off + static_cast<double>(off[i])); }

  void copy(std::size_t i, std::size_t to) {
    on[to] = on[i], off[to] = off[i], reference[to] = reference[i], leak[to] = leak[i], from[to] = from[i];
  }
};

}  // namespace esim

#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"

namespace esim::inline fit {

/// Light that fills the view: lux (1 + modulation sin(2 pi frequency t)), of which the phase is not known. NaN:
/// unknown.
struct KnownLight {
  double lux = std::numeric_limits<double>::quiet_NaN();  ///< mean illuminance of the sensor
  double frequency_hz = 0;                                ///< 0: constant light
  double modulation = 0;                                  ///< (max - min) / (max + min), between 0 and 1

  bool flickers() const { return frequency_hz > 0; }
};

/// The events of each pixel in known light.
struct PixelCounts {
  struct Pixel {
    std::uint32_t on = 0, off = 0;
  };
  KnownLight light;
  Image<Pixel> pixels;
  double extent = 0;         ///< complete periods of a lamp; seconds of constant light
  double peak_hz = 0;        ///< events per second of the sensor; of a lamp in the busiest of 16 parts of the period
  std::string problem{};     ///< why they tell nothing about the circuit; empty if they do
  std::string file{};        ///< name of the recording; may be empty
  std::string name() const;  ///< "lamp.raw (150 Hz at 20 lux)", "constant 5 lux"
  double rate_hz() const;    ///< events of a pixel per second, on average
};

/// Counts them, of a lamp in complete periods from the first event on.
class PixelCounter {
 public:
  PixelCounter(const KnownLight& light, int width, int height) : light_(light), pixels_(width, height) {}

  /// Events in order of time.
  void add(EventSpan events);

  /// `duration_s`: of the recording.
  PixelCounts finish(double duration_s) const;

 private:
  static constexpr std::size_t kParts = 16;
  // Frequencies at which the events may repeat: that of the lamp over these numbers.
  static constexpr std::array kDivisors{1, 2, 3};

  void count(const Event& event);
  void add_phases(const Event& event, double periods);
  double clarity(std::size_t divisor) const;
  std::string problem() const;
  std::string problem_of_lamp() const;

  KnownLight light_;
  Image<PixelCounts::Pixel> pixels_;
  std::vector<Event> pending_;  // of the period that has begun
  std::optional<TimeNs> first_;
  std::int64_t periods_ = 0;
  std::array<std::uint64_t, kParts> by_phase_{};                                // events
  std::array<std::array<std::complex<double>, 2>, kDivisors.size()> phases_{};  // sums of unit vectors, by polarity
  std::uint64_t on_ = 0, off_ = 0, events_ = 0;                                 // in complete periods; all
};

}  // namespace esim::inline fit

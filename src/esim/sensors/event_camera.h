#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esim/core/describe.h"
#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/core/random.h"
#include "esim/events/event.h"
#include "esim/events/event_queue.h"
#include "esim/render/sample.h"

namespace esim {

/// Parameters of an event camera. Thresholds are changes of log-brightness, L = ln(E + log_eps).
struct EventCameraOptions {
  double contrast_threshold = 0.5;
  std::optional<double> contrast_threshold_on{};   ///< C+; contrast_threshold where not set
  std::optional<double> contrast_threshold_off{};  ///< C-; contrast_threshold where not set
  double threshold_mismatch = 0.0;
  double threshold_noise = 0.0;
  double refractory_period_us = 0.0;
  double log_eps = 0.001;

  double threshold_on() const { return contrast_threshold_on.value_or(contrast_threshold); }
  double threshold_off() const { return contrast_threshold_off.value_or(contrast_threshold); }
};

template <class Visitor>
void describe(Visitor& visit, EventCameraOptions& o) {
  visit("contrast_threshold", o.contrast_threshold,
        About{"change of log-brightness that fires an event", "", 0.01, 100});
  visit("contrast_threshold_on", o.contrast_threshold_on,
        About{"the same for ON events, C+ (default: contrast_threshold)", "", 0.01, 100});
  visit("contrast_threshold_off", o.contrast_threshold_off,
        About{"the same for OFF events, C- (default: contrast_threshold)", "", 0.01, 100});
  visit("threshold_mismatch", o.threshold_mismatch,
        About{"standard deviation of the thresholds from pixel to pixel, fixed in time", "", 0, 10});
  visit("threshold_noise", o.threshold_noise,
        About{"standard deviation of a pixel's thresholds from event to event (sigma_C)", "", 0, 10});
  visit("refractory_period_us", o.refractory_period_us,
        About{"time after an event during which a pixel is held in reset", "us", 0, 1e9});
  visit("log_eps", o.log_eps, About{"added to the irradiance before the logarithm", "", 0, 1, true});
}

/// Smallest threshold of any pixel, whatever the noise: keeps the number of events of a step finite.
inline constexpr double kMinContrastThreshold = 0.01;

/// The event sensor: a field of independent pixels (paper, Section 3). Each watches its brightness L(t), taken as
/// linear in time between two samples, and fires at the time at which L has risen by C+ or fallen by C- from its
/// reference; the level reached becomes the new reference. After an event the pixel is held in reset for the refractory
/// period, and its reference is then the brightness at the period's end, as in silicon.
///
/// Thresholds are C + mismatch(pixel) + noise(pixel, event): the noise is drawn once for each event, not for each
/// sample, so that events do not depend on how densely the signal was sampled.
class EventCamera {
 public:
  /// `stream` separates the random numbers of cameras that share a seed.
  EventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);
  ~EventCamera();
  EventCamera(EventCamera&&) noexcept;
  EventCamera& operator=(EventCamera&&) noexcept;

  /// Takes what is newly known of the pixels' irradiance: per tile, segments contiguous in time. Each pixel's first
  /// segment sets its reference at t0 and fires nothing before. Throws UserError naming the pixel and the time where an
  /// irradiance is negative or not finite.
  void integrate(std::span<const Segment> segments, const Workers& workers);

  /// Appends to `out`, in order, the events with t <= watermark that were not released before. Nothing at or before the
  /// watermark may be integrated afterwards.
  void release_until(TimeNs watermark, std::vector<Event>& out) { queue_.release_until(watermark, out); }

 private:
  class Crossings;  // works through the pixels of a piece of a segment that leave their bands

  void open(const Segment& segment, int row);
  void draw_thresholds(std::size_t pixel);
  void set_band(std::size_t pixel, double rise, double fall);

  EventCameraOptions options_;
  int width_;
  TimeNs refractory_;
  AddressedRandom noise_;

  /// What is needed of a pixel when it leaves its band, together in memory. Light is E + log_eps, so that a change of
  /// brightness is a factor.
  struct Pixel {
    double reference = 0;       // light at the last event
    double rise = 1, fall = 1;  // factors to the next levels: exp(C+), exp(-C-)
    TimeNs reset_until = 0;     // kReady, or the end of the refractory period
  };

  // A pair of irradiances per pixel, strictly between which nothing can fire: most pixels of most segments are settled
  // by two comparisons, without a logarithm.
  std::vector<float> band_low_, band_high_;
  std::vector<Pixel> pixels_;
  std::vector<float> mean_on_, mean_off_;  // thresholds with the pixel's mismatch
  std::vector<std::uint32_t> draws_;       // threshold draws so far, per pixel

  EventQueue queue_;
  std::vector<Crossings> pieces_;  // one per piece of a parallel loop
};

}  // namespace esim

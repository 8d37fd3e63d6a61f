#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/fit/equations.h"
#include "esim/fit/estimate.h"

namespace esim::inline fit {

/// Thresholds of the pixels of a sensor that saw a moving scene, from its events and from images of the same view
/// (docs/methods/fitting.md, section 1).
///
/// At an event, the brightness L of a pixel has moved from its reference by exactly one threshold. Until the next event
/// of the same polarity, a time T later, it moves by the threshold and by what the pixel misses in its refractory
/// period R: if it moves evenly, by C T / (T - R) in all. So, with P the number of thresholds that ON events tell, and
/// M that of OFF events,
///
///   L(t) = c + C+ P - C- M - leak t + D L'(t) + d p - o / E(t)
///
/// with the leak in ln/s, the delay D of the events, the polarity p of the events, and the offset o of the logarithm,
/// L = ln(E + o). This is linear in all unknowns: least squares. If images follow each other twice as fast as the
/// events of the pixel, t is the time of an event, and L is interpolated between the two images around it, which then
/// also tell what the pixel misses. Otherwise, t is the time of an image, and P or M is interpolated between two events
/// of the same polarity.
///
/// C+, C- and the leak are those of each pixel, the other unknowns are common. Odd and even stretches of time give
/// independent estimates of each pixel, whose covariance is that of the pixels' thresholds. Pixels with low thresholds
/// have more events: so that they do not count more often, pixels count if nine tenths of those around them have enough
/// events, too. Intervals come from a jackknife over 8 x 8 areas of the sensor.
class ContrastFit {
 public:
  struct Options {
    double refractory_s = 0;
    double offset = 0;         ///< o, in units of the images, or its first value
    bool find_offset = false;  ///< whether o is unknown: needs a scene with light and dark surfaces
  };
  ContrastFit(int width, int height, const Options& options);

  /// The next image of the linear intensity, in any unit, and all events since the previous image until `t`, in order
  /// of time. Values that are not above 0, or not finite, are unknown. The first image may have events before it, which
  /// do not count. Throws UserError if the size differs, or if `t` is not later than the previous image.
  void add(TimeNs t, const Image<float>& intensity, EventSpan events);

  /// Ends a recording: the next image begins another one of the same sensor.
  void end_recording();

  struct Result {
    Estimate on, off;           ///< contrast_threshold_on and _off, ln
    Estimate mismatch, common;  ///< threshold_mismatch, ln; circuit.threshold_mismatch_common, relative
    Estimate delay;             ///< of the events behind the images, us
    Estimate offset;            ///< of the logarithm, in units of the images
    Estimate dead;              ///< dead_pixels
    FittedDistribution pixels_on, pixels_off;
    std::uint64_t equations = 0, pixels = 0;  ///< that count
    double residual = 0;                      ///< standard deviation of the equations, ln
    double explained = 0;                     ///< fraction of the variance of L that the events explain
  };
  Result finish();

 private:
  struct KeptImage {
    TimeNs t;
    std::vector<float> logs;  // L; NaN: unknown
  };

  // Thresholds that events tell since the last gap.
  struct Chain {
    double on = 0, off = 0;
    double missed = 0;  // ln, as images tell

    Chain plus(int polarity, double way) const {
      return polarity > 0 ? Chain{on + way, off, missed} : Chain{on, off + way, missed};
    }
  };
  struct Pixel {
    TimeNs last = 0, between = 0;     // event; time from the event before
    float brightness = 0, slope = 0;  // L and dL/dt at this event, by the images around it
    TimeNs images_apart = 0;          // these images; 0: not known
    std::int8_t polarity = 0;         // of that event; 0: none, or what happened since is unknown
    Chain chain;
    TimeNs since = 0;          // the end of the last gap
    std::uint32_t events = 0;  // all
    // Sums over the open stretch.
    std::uint32_t count = 0, stretches = 0;
    Equation sums{};
    EquationProducts products{};
    std::array<EquationProducts, 2> halves{};  // of closed stretches, about their means
    std::array<std::uint32_t, 2> equations{};
  };

  static constexpr std::size_t kKeptImages = 8;
  static constexpr std::uint32_t kStretch = 12;  // equations with one constant c

  void add_event(const Event& event);
  void look_at_images(const Event& event);
  void compare_at_image(Pixel& pixel, const Event& event, double way) const;
  void add_equation(Pixel& pixel, const Chain& chain, TimeNs t, double slope, double brightness) const;
  static void close(Pixel& pixel);
  Estimate find_dead_pixels() const;

  Options options_;
  Image<Pixel> pixels_;
  std::deque<KeptImage> images_;  // the last ones
};

}  // namespace esim::inline fit

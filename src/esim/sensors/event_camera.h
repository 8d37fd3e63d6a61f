#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/events/event.h"
#include "esim/render/sample.h"
#include "esim/sensors/event_camera_options.h"

namespace esim {

/// What became of a camera's events.
struct EventCameraStatistics {
  std::int64_t dropped = 0;  ///< by the readout, whose queue was full
  std::int64_t delayed = 0;  ///< read out more than 1 us after the request, or 1 % of the refractory period if shorter
  TimeNs longest_delay = 0;  ///< from a pixel's request to its readout
  std::int64_t in_flight = 0;  ///< fired, but not read out by the last watermark
};

/// The event sensor: a field of independent pixels (paper, Section 3). Each watches its brightness L(t), taken as
/// linear in time between two samples, and fires at the time at which it has risen by C+ or fallen by C- from its
/// reference; the level reached becomes the new reference.
///
/// Every effect is a law in continuous time, so that none depends on how densely the signal was sampled: the
/// photoreceptor's low-pass is solved exactly on each segment, thresholds and leaks are drawn once for each event, shot
/// noise is a Poisson process of its own. EventCameraOptions lists them; docs/methods/pixel.md gives the equations.
///
/// Each frame of a user's own, in order, goes through process(); samples of tiles go through integrate() and
/// release_until(). Use one or the other.
class EventCamera {
 public:
  /// `stream` separates the random numbers of cameras that share a seed. Throws UserError where the options do not fit
  /// the size.
  EventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed = 0,
              std::uint16_t stream = 0);
  ~EventCamera();
  EventCamera(EventCamera&&) noexcept;
  EventCamera& operator=(EventCamera&&) noexcept;

  /// Takes the irradiance of all pixels at time t (linear, >= 0, 1 = white), and appends to `out`, in order, the events
  /// since the frame before. The first frame sets the references and fires nothing. Throws UserError naming the frame
  /// where its size differs, its time does not come after the one before, or a pixel is not a finite number >= 0; the
  /// camera is then as it was before.
  void process(const Image<float>& irradiance, TimeNs t, std::vector<Event>& out, const Workers& workers);

  /// The same from the memory of somebody else: rows one after the other, without padding.
  void process(std::span<const float> irradiance, TimeNs t, std::vector<Event>& out, const Workers& workers);

  /// Takes what is newly known of the pixels' irradiance: those of a tile one after the other, contiguous in time. Each
  /// pixel's first segment is an instant, sets its reference, and fires nothing before. Throws UserError naming the
  /// pixel and the time where an irradiance is not a finite number >= 0; nothing of that segment has then been seen.
  /// `watermark`: no segment that is still to come begins before it. It must not decrease.
  void integrate(std::span<const Segment> segments, TimeNs watermark, const Workers& workers);

  /// Appends to `out`, in order, the events with t <= until that were not released before. `until` must not be later
  /// than the watermark of the last integrate().
  void release_until(TimeNs until, std::vector<Event>& out);

  EventCameraStatistics statistics() const;

  /// All that the camera remembers, as bytes for restore(), by the same build of esim. They do not say how the camera
  /// was made: neither options, size, seed nor stream.
  std::vector<std::byte> state() const;

  /// Makes a camera go on where one that was made alike was: it will give the same events. Throws UserError for bytes
  /// of another length; the camera is then of no use.
  void restore(std::span<const std::byte> state);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace esim

// Accelerates reference.h: the same camera, for any segments of any tiles, with threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/event_camera/options.h"
#include "esim/events/event.h"
#include "esim/events/event_label.h"
#include "esim/filters/filter_chain.h"
#include "esim/render/sample.h"

namespace esim::inline event_camera {

/// Statistics of a camera's readout and of its filters.
struct EventCameraStatistics {
  std::int64_t dropped = 0;  ///< dropped by the readout because its queue was full
  std::int64_t delayed = 0;  ///< read out more than 1 us after the request, or 1 % of the refractory period if shorter
  TimeNs longest_delay = 0;  ///< from a pixel's request to its readout
  std::int64_t lost = 0;     ///< beyond the maximum rate of their pixels (CircuitOptions::max_rate_hz)
  std::int64_t in_flight = 0;  ///< generated, but not read out by the last watermark
  std::int64_t read_out = 0;   ///< events that left the readout, and that the filters received

  std::vector<FilterChain::Dropped> filtered{};  ///< events dropped by each filter, in the order of the filters
};

/// The event sensor: an array of independent pixels (paper, Section 3). The brightness L(t) of a pixel is linear in
/// time between two samples. The pixel fires when L has risen by C+ or fallen by C- from its reference; this level
/// becomes the new reference.
///
/// Every effect is defined in continuous time, so that none depends on the sampling density: the photoreceptor's
/// low-pass is solved exactly on each segment, thresholds and leaks are drawn once per event, and shot noise is a
/// separate Poisson process. EventCameraOptions lists the effects; docs/methods/pixel.md gives the formulae.
/// The events that leave the readout pass the filters of the options; those that a filter drops never leave the camera.
///
/// Use either process() for whole frames in order, or integrate() and release_until() for samples of tiles.
class EventCamera {
 public:
  /// `stream` separates the random numbers of cameras with the same seed. Throws UserError if the size does not support
  /// the options, or if these contradict each other.
  EventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed = 0,
              std::uint16_t stream = 0);
  ~EventCamera();
  EventCamera(EventCamera&&) noexcept;
  EventCamera& operator=(EventCamera&&) noexcept;

  /// Takes the irradiance of all pixels at time t (linear, >= 0, 1 = white), and appends to `out`, in order, the events
  /// since the previous frame. The first frame sets the references and fires no events. Throws UserError naming the
  /// frame if its size differs, if its time is not after that of the previous frame, or if a pixel is not a finite
  /// number >= 0; the camera is then unchanged.
  void process(const Image<float>& irradiance, TimeNs t, std::vector<Event>& out, const Workers& workers);

  /// The same from external memory: consecutive rows without padding.
  void process(std::span<const float> irradiance, TimeNs t, std::vector<Event>& out, const Workers& workers);

  /// Takes new segments of the pixels' irradiance; the segments of a tile must be contiguous in time. The first segment
  /// of a pixel is an instant, which sets its reference. Throws UserError naming the pixel and the time if an
  /// irradiance is not a finite number >= 0; that segment has then no effect. `watermark`: no future segment begins
  /// before it. It must not decrease.
  void integrate(std::span<const Segment> segments, TimeNs watermark, const Workers& workers);

  /// Returns, in order, the events with t <= until that were not released before; they are valid until the next call.
  /// `until` must not be later than the watermark of the last integrate().
  EventSpan release_until(TimeNs until);

  /// The labels of the events of the last release_until() or process(), in their order, with object 0 and
  /// semantic class 0; empty unless the options request labels.
  LabelSpan labels() const;
  bool has_labels() const;

  /// No label of a later event has an earlier ideal time.
  TimeNs labels_from() const;

  EventCameraStatistics statistics() const;

  /// The state of the camera as bytes for restore() of the same build of esim. The bytes do not contain the arguments
  /// of the constructor: options, size, seed and stream.
  std::vector<std::byte> state() const;

  /// Restores the state of a camera that was created with the same arguments: it continues with the same events. Throws
  /// UserError for bytes of another length; the camera can then no longer be used.
  void restore(std::span<const std::byte> state);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace esim::inline event_camera

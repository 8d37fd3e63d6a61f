#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/event_camera/options.h"
#include "esim/events/event.h"
#include "esim/events/event_label.h"

namespace esim::inline event_camera {

/// The definition of the event camera: one pixel at a time and one event at a time, in double precision, with every
/// effect of EventCameraOptions except the filters, which belong to the folder `filters`. Numbers in brackets in
/// reference.cpp, reference_signal.h and the files of EventCamera are those of the equations in docs/methods/pixel.md.
///
/// EventCamera accelerates it, and draws the same random numbers: their events are the same, with times that agree
/// within the rounding of EventCamera's floats. This class is much slower; it serves to read and to test.
class ReferenceEventCamera {
 public:
  ReferenceEventCamera(const EventCameraOptions& options, int width, int height, std::uint64_t seed = 0,
                       std::uint16_t stream = 0);
  ~ReferenceEventCamera();

  /// Takes the irradiance of all pixels at time t (linear, >= 0, 1 = white; times must increase), and returns, in
  /// order, the events since the previous frame. The first frame sets the references. Time stamps include latencies, so
  /// that they may be later than t.
  std::vector<Event> process(const Image<float>& irradiance, TimeNs t);

  /// The labels of the events that the last process() returned, in their order; whatever `labels` of the options says.
  const std::vector<EventLabel>& labels() const;

 private:
  class Model;
  std::unique_ptr<Model> model_;
};

}  // namespace esim::inline event_camera

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/events/event_label.h"
#include "esim/light/flicker.h"

namespace esim::inline sim {

/// Takes the part of flickering light out of EventLabel::signal.
class FlickerLabels {
 public:
  /// `start`: of the simulation, ns.
  FlickerLabels(int width, int height, TimeNs start);

  /// Sets EventLabel::flicker of the next events of a camera, whose EventLabel::object is known: the change of the
  /// logarithm of the light from the pixel's previous event to this one, for a white surface, but not more than the
  /// signal and not against its sign.
  void set(const Flicker& flicker, std::span<const Event> events, std::span<EventLabel> labels);

  /// The state, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.fixed(self.last_);
  }

 private:
  int width_;
  std::vector<TimeNs> last_;  // ideal time of each pixel's previous event
};

}  // namespace esim::inline sim

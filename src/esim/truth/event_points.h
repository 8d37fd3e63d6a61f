#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event.h"
#include "esim/render/renderer.h"
#include "esim/truth/bearings.h"

namespace esim {

/// Where in the world the surfaces are that events see: for each event, its pixel alone is rendered at its own time.
/// Exact to the renderer's rounding for the pixel's centre at the event's time stamp; an event of noise has the point
/// that its pixel happens to see, and where the sensor delays events, the points are those of their stamps.
class EventPoints {
 public:
  using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Camera& camera, const Workers& workers)>;

  /// The renderer is one on the processor: many threads ask it for single pixels at once. `view_at` says where camera
  /// and objects are, for times of `covered`; events after it see what is seen at its end.
  EventPoints(const Camera& camera, const MakeRenderer& make_renderer, std::function<RenderRequest(TimeNs)> view_at,
              const TimeSpan& covered, const Workers& workers);

  /// The point that each event sees, world frame, m; NaN where that is infinitely far, or nothing.
  void locate(EventSpan events, std::vector<Eigen::Vector3f>& points);

 private:
  Eigen::Vector3f locate(const Event& event, Sample& sample) const;

  Image<Eigen::Vector2d> bearings_;
  Workers alone_{1};  // a pixel is not divided
  std::unique_ptr<Renderer> renderer_;
  std::function<RenderRequest(TimeNs)> view_at_;
  TimeSpan covered_;
  const Workers& workers_;
  std::vector<Sample> samples_;  // of each thread
};

}  // namespace esim

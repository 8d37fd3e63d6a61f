#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event.h"
#include "esim/render/renderer.h"
#include "esim/truth/bearings.h"

namespace esim::inline truth {

/// Finds the scene points that events see: for each event, only its pixel is rendered, at the time of the event. The
/// points are exact, up to the renderer's rounding, for the pixel's centre at the event's time stamp. A noise event has
/// the point that its pixel sees; if the sensor delays events, the points belong to the delayed time stamps.
class EventPoints {
 public:
  using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Camera& camera, const Workers& workers)>;

  /// The renderer must run on the CPU: many threads request single pixels at the same time. `view_at` gives the poses
  /// of camera and objects for times within `covered`; later events see the scene at its end.
  EventPoints(const Camera& camera, const MakeRenderer& make_renderer, std::function<RenderRequest(TimeNs)> view_at,
              const TimeSpan& covered, const Workers& workers);

  /// The point that each event sees, world frame, m; NaN if it is at infinity or there is no surface.
  void locate(EventSpan events, std::vector<Eigen::Vector3f>& points);

 private:
  Eigen::Vector3f locate(const Event& event, Sample& sample) const;

  Image<Eigen::Vector2d> bearings_;
  Workers alone_{1};  // a single pixel is not parallel
  std::unique_ptr<Renderer> renderer_;
  std::function<RenderRequest(TimeNs)> view_at_;
  TimeSpan covered_;
  const Workers& workers_;
  std::vector<Sample> samples_;  // of each thread
};

}  // namespace esim::inline truth

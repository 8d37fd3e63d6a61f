#include "esim/truth/event_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline truth {
namespace {

constexpr std::size_t kPortion = 256;  // events per task of a parallel loop

}  // namespace

EventPoints::EventPoints(const Camera& camera, const MakeRenderer& make_renderer,
                         std::function<RenderRequest(TimeNs)> view_at, const TimeSpan& covered, const Workers& workers)
    : bearings_(bearings_of(camera)),
      renderer_(make_renderer(camera, alone_)),
      view_at_(std::move(view_at)),
      covered_(covered),
      workers_(workers),
      samples_(static_cast<std::size_t>(workers.threads())) {}

void EventPoints::locate(EventSpan events, std::vector<Eigen::Vector3f>& points) {
  points.resize(events.size());
  const std::size_t portions = (events.size() + kPortion - 1) / kPortion;
  workers_.for_each_with_worker(static_cast<int>(portions), [&](int portion, int worker) {
    const std::size_t first = static_cast<std::size_t>(portion) * kPortion;
    const std::size_t end = std::min(first + kPortion, events.size());
    for (std::size_t i = first; i < end; ++i) points[i] = locate(events[i], samples_[static_cast<std::size_t>(worker)]);
  });
}

Eigen::Vector3f EventPoints::locate(const Event& event, Sample& sample) const {
  RenderRequest request = view_at_(std::clamp(event.t, covered_.start, covered_.end));
  request.tiles = {{event.x, event.y, 1, 1}};
  const SE3 T_world_camera = request.camera.T_world_body;
  renderer_->render(std::move(request), sample);
  const double depth = sample.depth(event.x, event.y);
  if (!std::isfinite(depth)) return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  return (T_world_camera * (depth * bearings_(event.x, event.y).homogeneous())).cast<float>();
}

}  // namespace esim::inline truth

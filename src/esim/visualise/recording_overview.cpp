#include "esim/visualise/recording_overview.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline visualise {
namespace {

constexpr double kMaxSeconds = 1e9;  // limit of given times, so that sums stay in range

TimeNs bounded_ns(double seconds) { return to_ns(std::clamp(seconds, 0.0, kMaxSeconds)); }

}  // namespace

std::optional<RecordStamp> stamp_of(const Record& record) {
  if (const auto* events = std::get_if<EventsRecord>(&record)) {
    if (events->events.empty()) return std::nullopt;
    return RecordStamp{events->camera, events->events.front().t, events->events.back().t};
  }
  if (const auto* truth = std::get_if<TruthRecord>(&record)) return RecordStamp{truth->camera, truth->t, truth->t};
  if (const auto* image = std::get_if<ImageRecord>(&record)) return RecordStamp{image->camera, image->t, image->t};
  if (const auto* frame = std::get_if<FrameRecord>(&record)) return RecordStamp{frame->camera, frame->t, frame->t};
  return std::nullopt;
}

std::vector<View> views_of(const RecordingOverview& overview) {
  std::vector<View> views = {View::events, View::time_surface, View::space_time};
  const bool truth = overview.last.contains(Content::truth);
  if (truth || overview.last.contains(Content::images) || overview.last.contains(Content::frames))
    views.push_back(View::image);
  if (truth && overview.depth.near_m() > 0) views.push_back(View::depth);
  if (truth) views.push_back(View::motion);
  return views;
}

std::optional<RecordingOverview> read_overview(Source& source, const Extent& extent,
                                               const std::function<bool(double)>& proceed) {
  const auto& cameras = source.info().cameras;
  RecordingOverview found;
  if (extent.camera < static_cast<int>(cameras.size())) {
    const Camera& model = cameras[static_cast<std::size_t>(extent.camera)].model;
    found.sensor = {model.width, model.height};
  }
  const bool sensor_known = found.sensor.width > 0 && found.sensor.height > 0;
  found.origin = source.info().start;
  found.start = found.origin + bounded_ns(extent.start_s);
  const TimeNs end =
      extent.duration_s ? found.start + bounded_ns(*extent.duration_s) : std::numeric_limits<TimeNs>::max();
  found.end = found.start;
  while (const Record* record = source.next()) {
    if (!proceed(source.progress())) return std::nullopt;
    const auto stamp = stamp_of(*record);
    if (!stamp || stamp->camera != extent.camera) continue;
    found.last[content_of(*record)] = stamp->last;
    if (const auto* events = std::get_if<EventsRecord>(record)) {
      for (const Event& event : events->events) {
        if (!sensor_known) {
          found.sensor.width = std::max(found.sensor.width, event.x + 1);
          found.sensor.height = std::max(found.sensor.height, event.y + 1);
        }
        if (event.t >= found.start && event.t <= end) ++found.events;
      }
    } else if (const auto* truth = std::get_if<TruthRecord>(record)) {
      found.depth.include(truth->depth);
      found.motion.include(truth->motion_x, truth->motion_y);
    }
    found.end = std::clamp(stamp->last, found.end, end);
    if (stamp->first > end && std::holds_alternative<EventsRecord>(*record)) break;
  }
  return found;
}

}  // namespace esim::inline visualise

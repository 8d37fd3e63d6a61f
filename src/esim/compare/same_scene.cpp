#include "esim/compare/same_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/represent/representations.h"

namespace esim::inline compare {
namespace {

constexpr int kSurfaces = 20, kVoxelBins = 5;
constexpr TimeNs kVoxelWindow = 50 * kNsPerMs;
constexpr TimeNs kSurfaceMemory = 300 * kNsPerMs;  // 10 tau: older events have less than 5e-5

/// Sums of the differences of images, and of what they would be without anything in common.
struct Differences {
  double apart = 0, all = 0;
  double relative() const { return all > 0 ? apart / all : std::numeric_limits<double>::quiet_NaN(); }
};

void add_surfaces(EventSpan first, EventSpan second, const SensorSize& sensor, TimeNs t, Differences& sum) {
  const auto surface = [&](EventSpan events) {
    return time_surface(events_within(events, {t - kSurfaceMemory, t}), sensor.width, sensor.height, t, kSurfaceTau_s);
  };
  const ImageStack<float> a = surface(first), b = surface(second);
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    sum.apart += std::abs(static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]));
    sum.all += static_cast<double>(std::max(a.values[i], b.values[i]));
  }
}

void add_voxels(EventSpan first, EventSpan second, const SensorSize& sensor, const TimeSpan& span, Differences& sum) {
  const auto grid = [&](EventSpan events) {
    return voxel_grid(events_within(events, span), sensor.width, sensor.height, kVoxelBins, span);
  };
  const ImageStack<float> a = grid(first), b = grid(second);
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    sum.apart += std::abs(static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]));
    sum.all += std::abs(static_cast<double>(a.values[i])) + std::abs(static_cast<double>(b.values[i]));
  }
}

}  // namespace

EventSpan events_within(EventSpan events, const TimeSpan& span) {
  const auto before = [](const Event& event, TimeNs t) { return event.t < t; };
  const auto begin = std::lower_bound(events.begin(), events.end(), span.start, before);
  const auto end = std::lower_bound(begin, events.end(), span.end + 1, before);
  return {begin, end};
}

SceneComparison compare_scenes(EventSpan first, EventSpan second, const SensorSize& sensor) {
  SceneComparison result;
  if (first.empty() || second.empty()) throw UserError("a recording has no events, so that there is nothing to match");
  result.span = {std::max(first.front().t, second.front().t), std::min(first.back().t, second.back().t)};
  if (result.span.start >= result.span.end) {
    throw RemediableError(
        fmt::format("the recordings do not overlap in time: {:.6f} s to {:.6f} s, and {:.6f} s to {:.6f} s",
                    to_seconds(first.front().t), to_seconds(first.back().t), to_seconds(second.front().t),
                    to_seconds(second.back().t)),
        Remedy::shift_times);
  }
  const EventSpan a = events_within(first, result.span), b = events_within(second, result.span);
  result.events =
      compare_events(EventsByPixel(a, sensor.width, sensor.height), EventsByPixel(b, sensor.width, sensor.height));
  Differences surfaces, voxels;
  const TimeNs length = result.span.end - result.span.start;
  for (int k = 1; k <= kSurfaces; ++k) add_surfaces(a, b, sensor, result.span.start + length * k / kSurfaces, surfaces);
  for (TimeNs start = result.span.start; start < result.span.end; start += kVoxelWindow)
    add_voxels(a, b, sensor, {start, std::min(start + kVoxelWindow, result.span.end)}, voxels);
  result.surfaces = surfaces.relative();
  result.voxels = voxels.relative();
  return result;
}

}  // namespace esim::inline compare

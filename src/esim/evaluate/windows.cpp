#include "esim/evaluate/windows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace esim::inline evaluate {
namespace {

/// All spans of a length within `within` that begin at an instant of the curve.
std::vector<TimeSpan> candidates(const MotionCurve& motion, const TimeSpan& within, TimeNs length) {
  std::vector<TimeSpan> spans;
  for (std::size_t k = 0; k < motion.mean_px_per_s.size(); ++k) {
    const TimeNs start = motion.start + to_ns(static_cast<double>(k) / motion.rate_hz);
    if (start >= within.start && start + length <= within.end) spans.push_back({start, start + length});
  }
  if (spans.empty()) spans.push_back({within.start, std::min(within.end, within.start + length)});
  return spans;
}

}  // namespace

double MotionCurve::mean(const TimeSpan& span) const {
  const auto count = static_cast<std::ptrdiff_t>(mean_px_per_s.size());
  if (count == 0) return 0;
  const auto index = [&](TimeNs t) { return to_seconds(t - start) * rate_hz; };
  const auto first =
      std::clamp(static_cast<std::ptrdiff_t>(std::ceil(index(span.start) - 1e-6)), std::ptrdiff_t{0}, count - 1);
  const auto last = std::clamp(static_cast<std::ptrdiff_t>(std::floor(index(span.end) + 1e-6)), first, count - 1);
  double sum = 0;
  for (std::ptrdiff_t k = first; k <= last; ++k) sum += mean_px_per_s[static_cast<std::size_t>(k)];
  return sum / static_cast<double>(last - first + 1);
}

MotionCurve measure_motion(const World& world, const std::vector<PixelPosition>& pixels, double rate_hz) {
  MotionCurve motion{world.info.start, rate_hz, {}, 0, 0};
  std::vector<Tile> tiles;
  for (const PixelPosition& p : pixels) tiles.push_back({p.x, p.y, 1, 1});
  Sample sample;
  for (std::int64_t k = 0;; ++k) {
    const TimeNs t = world.info.start + to_ns(static_cast<double>(k) / rate_hz);
    if (t > world.info.end) break;
    const RenderRequest request = view(world, 0, t, tiles);
    world.cameras[0].renderer->render(request, sample);
    double sum = 0;
    int counted = 0;
    for (const PixelPosition& p : pixels) {
      const double speed = std::hypot(sample.motion_x(p.x, p.y), sample.motion_y(p.x, p.y));
      if (!std::isfinite(speed)) continue;
      sum += speed;
      ++counted;
      motion.max_px_per_s = std::max(motion.max_px_per_s, speed);
    }
    motion.mean_px_per_s.push_back(counted > 0 ? sum / counted : 0.0);
    motion.fastest_turn_deg_per_s =
        std::max(motion.fastest_turn_deg_per_s, request.camera.omega_body.norm() * 180 / std::numbers::pi);
  }
  return motion;
}

std::vector<Window> choose_windows(const MotionCurve& motion, const TimeSpan& all, double length_s) {
  std::vector<Window> windows;
  const TimeNs length = to_ns(length_s);
  if (2 * length <= all.end - all.start) {
    const std::vector<TimeSpan> spans = candidates(motion, all, length);
    const auto slower = [&](const TimeSpan& a, const TimeSpan& b) { return motion.mean(a) < motion.mean(b); };
    const auto [slowest, fastest] = std::minmax_element(spans.begin(), spans.end(), slower);
    windows.push_back({"slow", *slowest, motion.mean(*slowest)});
    windows.push_back({"fast", *fastest, motion.mean(*fastest)});
  }
  windows.push_back({"all", all, motion.mean(all)});
  return windows;
}

TimeSpan typical_part(const MotionCurve& motion, const Window& window, double length_s) {
  const TimeNs length = std::min(to_ns(length_s), window.span.end - window.span.start);
  const std::vector<TimeSpan> spans = candidates(motion, window.span, length);
  const auto distance = [&](const TimeSpan& span) { return std::abs(motion.mean(span) - window.mean_px_per_s); };
  return *std::min_element(spans.begin(), spans.end(),
                           [&](const TimeSpan& a, const TimeSpan& b) { return distance(a) < distance(b); });
}

}  // namespace esim::inline evaluate

#include "esim/plot/tick_layout.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "esim/plot/canvas.h"
#include "esim/plot/theme.h"

namespace esim::inline plot {
namespace {

constexpr int kPerRow = 36, kPerColumn = 60;  // px for each tick, at least
constexpr int kMaxTicks = 10;

/// Whether the labels along an axis of `extent` px have space between each other.
bool labels_fit(const Scale& scale, const Ticks& ticks, int extent, Direction direction) {
  const double gap = (direction == Direction::horizontal ? 1.2 : 0.6) * kTextHeight;
  double end = -std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, double>> labels;
  for (const Tick& tick : ticks.major) {
    if (tick.label.empty()) continue;
    const double middle = scale.position(tick.value) * extent;
    const double half =
        0.5 * (direction == Direction::horizontal ? Canvas::text_width(tick.label, kTextHeight) : kTextHeight);
    labels.emplace_back(middle - half, middle + half);
  }
  std::sort(labels.begin(), labels.end());
  for (const auto& [first, last] : labels) {
    if (first < end + gap) return false;
    end = last;
  }
  return true;
}

}  // namespace

Ticks ticks_that_fit(const Scale& scale, int extent, Direction direction) {
  Ticks ticks;
  const int most = extent / (direction == Direction::horizontal ? kPerColumn : kPerRow);
  for (int wanted = std::clamp(most, 3, kMaxTicks); wanted >= 3; --wanted) {
    ticks = scale.ticks(wanted);
    if (labels_fit(scale, ticks, extent, direction)) return ticks;
  }
  for (std::size_t every = 2;; ++every) {
    Ticks sparse = ticks;
    for (std::size_t i = 0; i < sparse.major.size(); ++i) {
      if (i % every != 0) sparse.major[i].label.clear();
    }
    if (every >= sparse.major.size() || labels_fit(scale, sparse, extent, direction)) return sparse;
  }
}

}  // namespace esim::inline plot

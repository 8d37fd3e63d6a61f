#include "esim/motion/timed_pose.h"

#include <fmt/format.h>

#include <algorithm>

namespace esim::inline motion {

std::optional<StampFault> find_stamp_fault(std::span<const TimedPose> poses) {
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const TimeNs t = poses[i].t, before = poses[i - 1].t;
    if (t == before) {
      return StampFault{i, fmt::format("the stamp {} ns occurs twice; remove one of the two poses", t)};
    }
    if (t < before) {
      return StampFault{i, fmt::format("the stamp {} ns comes after {} ns; sort the poses by time", t, before)};
    }
  }
  if (poses.size() < 2) return std::nullopt;

  const TimeNs median = median_interval(poses);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const TimeNs gap = poses[i].t - poses[i - 1].t;
    if (gap / kLargestGapInMedians > median || (gap / kLargestGapInMedians == median && gap % kLargestGapInMedians)) {
      return StampFault{i,
                        fmt::format("no pose in the {:.6g} s before this one, more than {} times the median interval "
                                    "of {:.6g} s: the motion is undetermined there; add poses or split the list",
                                    to_seconds(gap), kLargestGapInMedians, to_seconds(median))};
    }
  }
  return std::nullopt;
}

TimeNs median_interval(std::span<const TimedPose> poses) {
  std::vector<TimeNs> intervals;
  for (std::size_t i = 1; i < poses.size(); ++i) intervals.push_back(poses[i].t - poses[i - 1].t);
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

}  // namespace esim::inline motion

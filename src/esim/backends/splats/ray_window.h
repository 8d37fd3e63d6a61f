#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esim/backends/splats/lanes.h"

// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

/// The contributions of splats to the pixels of a block, a lane each, that are not blended yet because others may be in
/// front of them. In each lane, they are sorted by depth.
class RayWindow {
 public:
  /// The contributions with the same rank, which in each lane may be of another splat. Larger keys are in front.
  struct Row {
    alignas(32) std::array<float, static_cast<std::size_t>(kLanes)> key, opacity;
    alignas(32) std::array<std::int32_t, static_cast<std::size_t>(kLanes)> splat;
  };

  void clear() { rows_.clear(), first_ = 0; }
  bool empty() const { return first_ == rows_.size(); }
  const Row& front() const { return rows_[first_]; }

  void pop() {
    constexpr std::size_t kMany = 256;
    if (++first_ < kMany) return;
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }

  /// Inserts a splat behind all that have the same key.
  void insert(Lanes key, Lanes opacity, std::int32_t splat) {
    const hn::RebindToSigned<LanesTag> integers;
    rows_.emplace_back();
    const auto inserted = hn::Set(integers, splat);
    Lanes key_here = key, opacity_here = opacity;
    auto splat_here = inserted;
    const auto store = [&](Row& row, auto key_in, auto opacity_in, auto splat_in) {
      hn::Store(key_in, kTag, row.key.data()), hn::Store(opacity_in, kTag, row.opacity.data());
      hn::Store(splat_in, integers, row.splat.data());
    };
    std::size_t i = rows_.size() - 1;
    for (; i > first_; --i) {
      const Row& above = rows_[i - 1];
      const Lanes key_above = hn::Load(kTag, above.key.data()), opacity_above = hn::Load(kTag, above.opacity.data());
      const auto splat_above = hn::Load(integers, above.splat.data());
      const auto passes = hn::Gt(key, key_above);
      if (hn::AllFalse(kTag, passes)) break;
      // In the lanes in which the splat is in front of the row above, that row moves down.
      const auto splat_passes = hn::RebindMask(integers, passes);
      store(rows_[i], hn::IfThenElse(passes, key_above, key_here), hn::IfThenElse(passes, opacity_above, opacity_here),
            hn::IfThenElse(splat_passes, splat_above, splat_here));
      key_here = hn::IfThenElse(passes, key, key_above);
      opacity_here = hn::IfThenElse(passes, opacity, opacity_above);
      splat_here = hn::IfThenElse(splat_passes, inserted, splat_above);
    }
    store(rows_[i], key_here, opacity_here, splat_here);
  }

 private:
  std::vector<Row> rows_;
  std::size_t first_ = 0;  // that is not blended
};

}  // namespace esim::inline backends::inline splats

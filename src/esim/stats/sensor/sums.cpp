#include "esim/stats/sensor/sums.h"

#include <utility>

namespace esim::inline stats {

void StreamSums::add(const StreamSums& other, std::uint64_t times) {
  events += times * other.events;
  on += times * other.on;
  stamps += times * other.stamps;
  same_us.add(other.same_us, times);
  after.add(other.after, times);
  pairs += times * other.pairs;
  alike += times * other.alike;
  intervals_us.add(other.intervals_us, times);
  for (std::size_t i = 0; i < fano.size(); ++i) fano[i].add(other.fano[i], times);
}

void PixelSums::add(const PixelSums& other, std::uint64_t times) {
  counts_on.add(other.counts_on, times);
  counts_off.add(other.counts_off, times);
  neighbours.add(other.neighbours, static_cast<double>(times));
}

void TimeBlocks::join_pairs() {
  std::vector<StreamSums> joined;
  for (std::size_t i = 0; i < blocks_.size(); i += 2) {
    joined.push_back(std::move(blocks_[i]));
    if (i + 1 < blocks_.size()) joined.back().add(blocks_[i + 1]);
  }
  blocks_ = std::move(joined);
  length_us_ *= 2;
}

}  // namespace esim::inline stats

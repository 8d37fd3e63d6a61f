#pragma once

#include <cstdint>
#include <vector>

#include "esim/filters/event_filter.h"
#include "esim/filters/options.h"

namespace esim::inline filters {

/// The anti-flicker filter of Prophesee's sensors (OpenEB: I_AntiFlickerModule). It watches blocks of 4 x 4 pixels. A
/// period of a block is the time from one change of its events from OFF to ON to the next, in units of 128 us. Each
/// period within the band adds 1 to the block's counter (at most 7), any other one subtracts 1. The block flickers from
/// `start_threshold` on until the counter has fallen to `stop_threshold`; without such a change for longer than the
/// longest period, the counter starts again at 0.
///
/// How the chip uses its duty cycle is not published, so it has no influence here.
class AntiFlickerFilter final : public EventFilter {
 public:
  AntiFlickerFilter(const AntiFlickerOptions& options, int width, int height);

  void process(EventSpan events, std::vector<Event>& out) override;

  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.fixed(self.blocks_);
  }

  static constexpr int kBlock_px = 4;
  static constexpr TimeNs kTick = 128 * kNsPerUs;  ///< unit of periods

 private:
  struct Block {
    std::int64_t rise = 0;     // last change from OFF to ON, ticks
    std::int8_t polarity = 0;  // of the last event; 0: no event yet
    std::uint8_t counter = 0;
    bool has_risen = false, flickers = false;
  };
  void see_rise(Block& block, std::int64_t now) const;

  FlickerMode mode_;
  std::int64_t shortest_, longest_;  // period, ticks
  int start_, stop_;
  std::size_t columns_;  // of blocks
  std::vector<Block> blocks_;
};

}  // namespace esim::inline filters

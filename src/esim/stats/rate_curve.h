#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline stats {

/// Events over time, counted in windows of 1 ms from the first event on. The width of the curve's bins doubles as
/// needed, so that there are at most kMaxBins bins.
class RateCurve {
 public:
  static constexpr std::size_t kMaxBins = 2048;

  struct Bin {
    std::uint64_t on = 0, off = 0;
  };

  /// `since_start` >= 0, ns, never decreasing.
  void add(TimeNs since_start, bool on) {
    const std::int64_t ms = since_start / kNsPerMs;
    if (ms != ms_) start_window(ms);
    window_.on += on;
    window_.off += !on;
  }

  /// Adds the window that is still open: call once, after the last event.
  void finish() { close_window(); }

  const std::vector<Bin>& bins() const { return bins_; }
  TimeNs bin_width() const { return kNsPerMs << doublings_; }

  /// Maximum number of events in one window of 1 ms, and in ten consecutive windows.
  std::uint64_t max_in_1_ms() const { return max_in_1_; }
  std::uint64_t max_in_10_ms() const { return max_in_10_; }

 private:
  void start_window(std::int64_t ms);
  void close_window();

  std::int64_t ms_ = 0;  // the open window
  Bin window_;
  std::array<std::uint64_t, 10> recent_{};  // of the last windows, by ms modulo 10
  std::uint64_t recent_sum_ = 0, max_in_1_ = 0, max_in_10_ = 0;
  std::vector<Bin> bins_;
  int doublings_ = 0;
};

}  // namespace esim::inline stats

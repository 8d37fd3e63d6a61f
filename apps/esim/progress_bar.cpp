#include "progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "support.h"

namespace esim::app {
namespace {

/// "1.23M" for 1234567.
std::string with_prefix(double value) {
  if (value >= 1e9) return fmt::format("{:.2f}G", value * 1e-9);
  if (value >= 1e6) return fmt::format("{:.2f}M", value * 1e-6);
  if (value >= 1e3) return fmt::format("{:.1f}k", value * 1e-3);
  return fmt::format("{:.0f}", value);
}

std::string minutes_and_seconds(double seconds) {
  const int whole = static_cast<int>(seconds + 0.5);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

ProgressBar::ProgressBar(bool wanted) : on_terminal_(wanted && isatty(STDERR_FILENO) == 1) {}

void ProgressBar::show(const Progress& progress) {
  const double done_s = to_seconds(progress.now - progress.start), all_s = to_seconds(progress.end - progress.start);
  show(all_s > 0 ? done_s / all_s : 1.0, [&] {
    return fmt::format("{:.3f}/{:.3f} s  {:.2f}x real time  {} events", done_s, all_s,
                       done_s / std::max(progress.wall_seconds, 1e-9),
                       with_prefix(static_cast<double>(progress.events)));
  });
}

void ProgressBar::show(double fraction, const std::function<std::string()>& what) {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  constexpr int kCells = 24;
  const auto now = std::chrono::steady_clock::now();
  if (!on_terminal_ || now - last_shown_ < kInterval) return;
  last_shown_ = now;

  const int full = std::clamp(static_cast<int>(fraction * kCells), 0, kCells);
  const double wall_s = std::chrono::duration<double>(now - start_).count();
  const double left_s = fraction > 0 ? wall_s * (1.0 - fraction) / fraction : 0.0;
  tell(stderr, "\r\033[K[{}{}] {}  {} left", std::string(static_cast<std::size_t>(full), '#'),
       std::string(static_cast<std::size_t>(kCells - full), '.'), what(),
       fraction > 0 ? minutes_and_seconds(left_s) : "-:--");
  std::fflush(stderr);
}

void ProgressBar::clear() {
  if (on_terminal_) tell(stderr, "\r\033[K");
}

}  // namespace esim::app

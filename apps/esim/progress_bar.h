#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "esim/sim/simulate.h"

namespace esim::app {

/// A progress bar of one line on a terminal; otherwise nothing.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted);
  void show(const Progress& progress);

  /// Shows `fraction` and the text of `what`, which is called only when the line is drawn.
  void show(double fraction, const std::function<std::string()>& what);

  void clear();

 private:
  bool on_terminal_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_shown_;
};

}  // namespace esim::app

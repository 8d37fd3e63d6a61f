#pragma once

#include <chrono>

#include "esim/sim/simulate.h"

namespace esim::app {

/// One line on a terminal that says how far a simulation is; on anything else, nothing until clear().
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted);
  void show(const Progress& progress);
  void clear();

 private:
  bool on_terminal_;
  std::chrono::steady_clock::time_point last_shown_;
};

}  // namespace esim::app

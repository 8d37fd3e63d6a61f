#pragma once

#include <chrono>

namespace esim::inline sim {

/// Adds the wall-clock time of a scope to a total.
class Stopwatch {
 public:
  explicit Stopwatch(double& total_seconds) : total_(total_seconds) {}
  ~Stopwatch() { total_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& total_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace esim::inline sim

#pragma once

#include <chrono>
#include <utility>

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

/// Calls `work` and returns its result. Adds the wall-clock time that it takes to a total, also if it throws.
template <typename Work>
decltype(auto) timed(double& total_seconds, Work&& work) {
  const Stopwatch stopwatch(total_seconds);
  return std::forward<Work>(work)();
}

}  // namespace esim::inline sim

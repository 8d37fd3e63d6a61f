#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "esim/scenario/scenario.h"
#include "esim/sim/simulate.h"
#include "esim/studio/live_picture.h"

namespace esim::studio {

enum class RunState { waiting, running, done, failed, cancelled };
std::string_view name_of(RunState state);

/// What is known of a run.
struct RunStatus {
  int id = 0;
  std::filesystem::path scenario{}, out{};
  RunState state = RunState::waiting;
  Progress progress{};
  bool loading = false;  ///< running, but not simulating yet
  std::string error{};   ///< of one that failed
  std::vector<std::string> notices{};
  int pictures = 0;  ///< how many there have been so far

  bool over() const { return state != RunState::waiting && state != RunState::running; }
};

/// Recordings that are made one after the other, whether or not anybody looks on.
class Runs {
 public:
  explicit Runs(int threads);

  /// Cancels all.
  ~Runs();

  /// Returns its number. The scenario has been read, `file` names it.
  int start(Scenario scenario, const std::filesystem::path& file, const std::filesystem::path& out, bool replace);

  std::vector<RunStatus> list() const;
  std::optional<RunStatus> find(int id) const;

  /// Whether a run that is not over writes there.
  bool writes_to(const std::filesystem::path& out) const;

  /// A PNG of what has come last; empty where there is nothing yet.
  std::string picture(int id) const;

  /// False where there is none of that number, or it is over.
  bool cancel(int id);

 private:
  struct Run;
  void work();
  void make(Run& run);
  std::shared_ptr<Run> of(int id) const;

  int threads_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<Run>> runs_;  // by number, from 1 on
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace esim::studio

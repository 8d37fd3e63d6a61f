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
#include "esim/studio/recordings/live_picture.h"

namespace esim::studio {

enum class RunState { waiting, running, done, failed, cancelled };
std::string_view name_of(RunState state);

/// The status of a run.
struct RunStatus {
  int id = 0;
  std::filesystem::path scenario{}, out{};
  RunState state = RunState::waiting;
  Progress progress{};
  bool loading = false;  ///< running, but not simulating yet
  std::string error{};   ///< of a failed run
  std::vector<std::string> notices{};
  int pictures = 0;  ///< number so far

  bool over() const { return state != RunState::waiting && state != RunState::running; }
};

/// Makes recordings one after the other, independent of open pages.
class Runs {
 public:
  explicit Runs(int threads);

  /// Cancels all runs.
  ~Runs();

  /// Adds a run and returns its number. The scenario has been read from `file`.
  int start(Scenario scenario, const std::filesystem::path& file, const std::filesystem::path& out, bool replace);

  std::vector<RunStatus> list() const;
  std::optional<RunStatus> find(int id) const;

  /// Whether an unfinished run writes to a folder.
  bool writes_to(const std::filesystem::path& out) const;

  /// A PNG of the current view; empty before the first.
  std::string picture(int id) const;

  /// False if there is no such run or it has ended.
  bool cancel(int id);

 private:
  struct Run;
  void work();
  void make(Run& run);
  std::shared_ptr<Run> of(int id) const;

  int threads_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<Run>> runs_;  // by number, from 1
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace esim::studio

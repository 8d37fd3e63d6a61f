#include "esim/studio/recordings/runs.h"

#include <algorithm>
#include <chrono>

#include "esim/compose/compose.h"
#include "esim/core/error.h"

namespace esim::studio {

std::string_view name_of(RunState state) {
  switch (state) {
    case RunState::waiting:
      return "waiting";
    case RunState::running:
      return "running";
    case RunState::done:
      return "done";
    case RunState::failed:
      return "failed";
    case RunState::cancelled:
      break;
  }
  return "cancelled";
}

struct Runs::Run {
  RunStatus status;  // guarded by Runs::mutex_
  Scenario scenario;
  bool replace = false;
  std::atomic<bool> cancelled{false};
  LivePicture picture;
};

namespace {

/// The command that makes the same recording.
std::string command_of(const std::filesystem::path& scenario, const std::filesystem::path& out, bool replace) {
  std::vector<std::string> words{"esim", "simulate", scenario.string(), "--out", out.string()};
  if (replace) words.push_back("--force");
  return shell_command(words);
}

}  // namespace

Runs::Runs(int threads) : threads_(threads), thread_([this] { work(); }) {}

Runs::~Runs() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    for (const auto& run : runs_) run->cancelled = true;
  }
  changed_.notify_all();
  thread_.join();
}

int Runs::start(Scenario scenario, const std::filesystem::path& file, const std::filesystem::path& out, bool replace) {
  const std::lock_guard lock(mutex_);
  auto run = std::make_shared<Run>();
  run->status.id = static_cast<int>(runs_.size()) + 1;
  run->status.scenario = file;
  run->status.out = out;
  run->scenario = std::move(scenario);
  run->replace = replace;
  runs_.push_back(run);
  changed_.notify_all();
  return run->status.id;
}

std::vector<RunStatus> Runs::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<RunStatus> all;
  for (const auto& run : runs_) all.push_back(run->status);
  return all;
}

std::shared_ptr<Runs::Run> Runs::of(int id) const {
  const std::lock_guard lock(mutex_);
  return id >= 1 && id <= static_cast<int>(runs_.size()) ? runs_[static_cast<std::size_t>(id) - 1] : nullptr;
}

std::optional<RunStatus> Runs::find(int id) const {
  const auto run = of(id);
  if (run == nullptr) return std::nullopt;
  const std::lock_guard lock(mutex_);
  return run->status;
}

bool Runs::writes_to(const std::filesystem::path& out) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(runs_.begin(), runs_.end(),
                     [&](const auto& run) { return !run->status.over() && run->status.out == out; });
}

std::string Runs::picture(int id) const {
  const auto run = of(id);
  return run == nullptr ? "" : run->picture.png();
}

bool Runs::cancel(int id) {
  const auto run = of(id);
  const std::lock_guard lock(mutex_);
  if (run == nullptr || run->status.over()) return false;
  run->cancelled = true;
  if (run->status.state == RunState::waiting) run->status.state = RunState::cancelled;
  return true;
}

void Runs::work() {
  while (true) {
    std::shared_ptr<Run> next;
    {
      std::unique_lock lock(mutex_);
      const auto waits = [](const auto& run) { return run->status.state == RunState::waiting; };
      changed_.wait(lock, [&] { return ending_ || std::any_of(runs_.begin(), runs_.end(), waits); });
      if (ending_) return;
      next = *std::find_if(runs_.begin(), runs_.end(), waits);
      next->status.state = RunState::running;
      next->status.loading = true;
    }
    std::string error;
    try {
      make(*next);
    } catch (const std::bad_alloc&) {
      error = "out of memory; use smaller images, a smaller scene, or a machine with more memory";
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    const std::lock_guard lock(mutex_);
    next->scenario = {};
    if (error.empty()) continue;
    next->status.state = RunState::failed;
    next->status.error = error;
  }
}

void Runs::make(Run& run) {
  const auto keep = [&](const std::string& text) {
    const std::lock_guard lock(mutex_);
    run.status.notices.push_back(text);
  };
  const Notices notices{[&](const std::string& text) { keep("warning: " + text); }, keep};

  constexpr auto kPicturePace = std::chrono::milliseconds(150);
  auto shown = std::chrono::steady_clock::now();
  const Monitor monitor = [&](const Progress& progress) {
    const auto now = std::chrono::steady_clock::now();
    const std::lock_guard lock(mutex_);
    run.status.progress = progress;
    run.status.loading = false;
    if (now - shown >= kPicturePace) {
      shown = now;
      ++run.status.pictures;
    }
    return !run.cancelled;
  };
  RecordingOptions options{.out = run.status.out,
                           .replace = run.replace,
                           .threads = threads_,
                           .beside = std::make_unique<LiveSink>(run.picture),
                           .repetition = {command_of(run.status.scenario, run.status.out, run.replace)}};
  const std::optional<Summary> summary = make_recording(run.scenario, std::move(options), notices, monitor);

  if (summary) std::ranges::for_each(losses(run.scenario, *summary), notices.warning);

  const std::lock_guard lock(mutex_);
  ++run.status.pictures;
  run.status.state = RunState::cancelled;
  if (summary && summary->complete) run.status.state = RunState::done;
  if (summary && !summary->problem.empty()) {
    run.status.state = RunState::failed;
    run.status.error = summary->problem;
  }
}

}  // namespace esim::studio

#include "esim/sweep/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <thread>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/files/folder_plan.h"
#include "esim/formats/events_file.h"
#include "esim/stats/event_statistics.h"

namespace esim::inline sweep {
namespace {

namespace fs = std::filesystem;

/// The real-time factor of a complete recording; empty if it is missing or incomplete.
std::optional<double> factor_of_complete(const fs::path& recording) {
  const auto text = read_text(recording / "report.json");
  if (!text) return std::nullopt;
  const nlohmann::json report = nlohmann::json::parse(*text, nullptr, false);
  if (!report.is_object() || report.value("status", "") != "complete") return std::nullopt;
  return report.value("real_time_factor", 0.0);
}

SweepRow row_of(const SweptEvents& swept, const fs::path& folder, const std::string& simulation, double factor) {
  constexpr std::size_t kPortion = 1 << 20;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  SweepRow row{.run = swept.run, .folder = fs::path(simulation) / swept.folder, .real_time_factor = factor};
  EventsFile file(folder / row.folder);
  EventStatistics counted(file.sensor());
  std::vector<Event> events;
  while (file.read(events, kPortion)) counted.add(events);
  const Statistics statistics = std::move(counted).finish();
  const IntervalHistogram& intervals = statistics.intervals;
  row.events = statistics.events();
  row.on_fraction = row.events > 0 ? static_cast<double>(statistics.on) / static_cast<double>(row.events) : kNone;
  row.mean_rate_hz = statistics.mean_rate_hz();
  row.rate_per_pixel_hz =
      statistics.counts.empty() ? 0.0 : row.mean_rate_hz / static_cast<double>(statistics.counts.size());
  row.interval_min_s = intervals.total() > 0 ? to_seconds(intervals.shortest()) : kNone;
  row.interval_1_percent_s = intervals.quantile_s(0.01);
  row.interval_median_s = intervals.quantile_s(0.5);
  row.interval_99_percent_s = intervals.quantile_s(0.99);
  return row;
}

class Sweeping {
 public:
  Sweeping(const SweepPlan& plan, const SweepWork& work, const SweepMonitor& monitor)
      : plan_(plan),
        work_(work),
        monitor_(monitor),
        rows_(plan.simulations.size()),
        lock_(work.folder, 0),
        fractions_(rows_.size()),
        events_(rows_.size()) {
    if (!lock_.owned()) {
      throw UserError(fmt::format("{}: another process is making this sweep; wait for its end", work.folder.string()));
    }
    complete_ = complete_simulations(plan, work.folder);
    missing_ = plan.simulations.size() - complete_;
  }

  std::optional<std::vector<SweepRow>> finish() {
    std::vector<std::thread> others;
    const auto jobs = std::min<std::size_t>(static_cast<std::size_t>(work_.jobs), rows_.size());
    for (std::size_t i = 1; i < jobs; ++i) others.emplace_back([&] { work(); });
    work();
    for (std::thread& other : others) other.join();
    if (problem_) std::rethrow_exception(problem_);
    if (stop_) return std::nullopt;
    std::vector<SweepRow> all;
    for (const std::vector<SweepRow>& rows : rows_) all.insert(all.end(), rows.begin(), rows.end());
    std::ranges::stable_sort(all, {}, &SweepRow::run);
    return all;
  }

 private:
  void work() {
    try {
      while (!stop_) {
        const std::size_t next = next_++;
        if (next >= rows_.size()) return;
        take(next);
      }
    } catch (...) {
      const std::lock_guard locked(mutex_);
      if (!problem_) problem_ = std::current_exception();
      stop_ = true;
    }
  }

  /// Makes a simulation unless it is complete, then the statistics of its events.
  void take(std::size_t index) {
    const SweptSimulation& simulation = plan_.simulations[index];
    const fs::path recording = work_.folder / simulation.name;
    auto factor = factor_of_complete(recording);
    if (!factor) {
      make(index, recording);
      if (stop_) return;
      factor = factor_of_complete(recording);
    }
    rows_[index].resize(simulation.events.size());
    Workers(work_.threads).for_each(static_cast<int>(simulation.events.size()), [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      if (keep_going())
        rows_[index][k] = row_of(simulation.events[k], work_.folder, simulation.name, factor.value_or(0));
    });
  }

  void make(std::size_t index, const fs::path& recording) {
    const SweptSimulation& simulation = plan_.simulations[index];
    const auto named = [&](const std::string& problem) {
      const bool alone = simulation.runs.size() == 1 && !plan_.over.empty();
      return fmt::format("{}{}: {}", simulation.name,
                         alone ? fmt::format(" ({})", values_of(plan_, simulation.runs.front())) : "", problem);
    };
    std::optional<Summary> summary;
    try {
      summary =
          make_recording(simulation.scenario,
                         {.out = recording, .replace = true, .threads = work_.threads, .repetition = work_.repetition},
                         notices(), [&](const Progress& progress) { return show(index, progress); });
    } catch (const OutputError& error) {
      throw OutputError(named(error.what()));
    } catch (const UserError& error) {
      throw UserError(named(error.what()));
    }
    if (!summary || !summary->complete) {
      if (summary && !summary->problem.empty()) throw UserError(named(summary->problem));
      stop_ = true;
      return;
    }
    const Notices notify = notices();
    for (const std::string& loss : losses(simulation.scenario, *summary)) notify.warning(loss);
    const std::lock_guard locked(mutex_);
    ++complete_;
    fractions_[index] = 1;
    monitor_.made(simulation, *summary, progress());
  }

  /// Passes each text on once.
  Notices notices() {
    const auto once = [this](const NoticeHandler& handler) {
      return [this, &handler](const std::string& text) {
        const std::lock_guard locked(mutex_);
        if (noticed_.insert(text).second) handler(text);
      };
    };
    return {once(monitor_.notices.warning), once(monitor_.notices.note)};
  }

  /// Shows the progress of a simulation. False if the sweep must end.
  bool show(std::size_t index, const Progress& now) {
    {
      const std::lock_guard locked(mutex_);
      if (now.end > now.start)
        fractions_[index] = static_cast<double>(now.now - now.start) / static_cast<double>(now.end - now.start);
      events_[index] = now.events;
    }
    return keep_going();
  }

  bool keep_going() {
    const std::lock_guard locked(mutex_);
    if (!stop_ && !monitor_.progress(progress())) stop_ = true;
    return !stop_;
  }

  SweepProgress progress() const {
    SweepProgress progress{.complete = complete_, .all = rows_.size()};
    for (const double fraction : fractions_) progress.fraction += fraction;
    progress.fraction = missing_ > 0 ? progress.fraction / static_cast<double>(missing_) : 1;
    progress.events = std::accumulate(events_.begin(), events_.end(), std::int64_t{0});
    return progress;
  }

  const SweepPlan& plan_;
  const SweepWork& work_;
  const SweepMonitor& monitor_;
  std::vector<std::vector<SweepRow>> rows_;  // of each simulation, written by the thread that takes it
  FolderLock lock_;
  std::size_t missing_ = 0;  // simulations to make
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> stop_ = false;

  std::mutex mutex_;  // of the members below, and of the monitor
  std::size_t complete_ = 0;
  // Of each simulation that this call makes:
  std::vector<double> fractions_;
  std::vector<std::int64_t> events_;
  std::set<std::string> noticed_;
  std::exception_ptr problem_;
};

}  // namespace

std::size_t complete_simulations(const SweepPlan& plan, const fs::path& folder) {
  return static_cast<std::size_t>(std::ranges::count_if(plan.simulations, [&](const SweptSimulation& simulation) {
    return factor_of_complete(folder / simulation.name).has_value();
  }));
}

std::optional<std::vector<SweepRow>> run_sweep(const SweepPlan& plan, const SweepWork& work,
                                               const SweepMonitor& monitor) {
  return Sweeping(plan, work, monitor).finish();
}

}  // namespace esim::inline sweep

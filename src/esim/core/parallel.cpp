#include "esim/core/parallel.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <thread>

namespace esim::inline core {

struct Workers::Arena {
  explicit Arena(int threads, int processors) : threads_count(threads), arena(std::min(threads, processors)) {}

  int threads_count;
  tbb::task_arena arena;
};

Workers::Workers(int threads) {
  const int processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  arena_ = std::make_unique<Arena>(threads > 0 ? threads : processors, processors);
}

Workers::~Workers() = default;

int Workers::threads() const { return arena_->threads_count; }

void Workers::for_each(int count, const std::function<void(int)>& body) const {
  for_each_with_worker(count, [&](int i, int) { body(i); });
}

void Workers::for_each_with_worker(int count, const std::function<void(int, int)>& body) const {
  if (threads() == 1 || count <= 1) {
    for (int i = 0; i < count; ++i) body(i, 0);
    return;
  }
#ifdef __SANITIZE_THREAD__
  // The thread sanitizer does not see TBB's synchronisation; this atomic shows it.
  std::atomic<int> order = 0;
  order.fetch_add(1);
  const auto run = [&](int i, int worker) {
    order.fetch_add(1);
    body(i, worker);
    order.fetch_add(1);
  };
#else
  const auto& run = body;
#endif
  arena_->arena.execute([&] {
    tbb::parallel_for(
        0, count, [&](int i) { run(i, tbb::this_task_arena::current_thread_index()); }, tbb::simple_partitioner{});
  });
#ifdef __SANITIZE_THREAD__
  order.fetch_add(1);
#endif
}

}  // namespace esim::inline core

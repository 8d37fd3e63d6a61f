#pragma once

#include <functional>
#include <memory>

namespace esim::inline core {

/// A fixed number of threads for data-parallel loops. Results must not depend on how work is divided:
/// callers split work into pieces, and each piece writes only its own data.
class Workers {
 public:
  /// `threads` ≥ 1, including the calling thread; 0: one per processor. At most as many threads as processors run at
  /// the same time.
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int threads() const;

  /// Calls body(i) once for each i in [0, count), in any order, on any of the threads; returns when all are
  /// done. The first exception thrown by a body is rethrown here.
  void for_each(int count, const std::function<void(int)>& body) const;

  /// As above, with body(i, worker): no two bodies that run at the same time have the same `worker` in [0, threads()),
  /// so that it can be the index of working memory.
  void for_each_with_worker(int count, const std::function<void(int, int)>& body) const;

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

}  // namespace esim::inline core

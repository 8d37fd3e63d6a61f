#pragma once

#include <functional>
#include <memory>

namespace esim {

/// A fixed number of threads for data-parallel loops. Results must not depend on how work is divided:
/// callers split work into pieces of their own choosing, and each piece writes only what belongs to it.
class Workers {
 public:
  /// `threads` ≥ 1, the calling thread included; 0 takes every processor. No more run at
  /// once than there are processors.
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int threads() const;

  /// Calls body(i) once for each i in [0, count), in any order, on any of the threads; returns when all are
  /// done. The first exception thrown by a body is rethrown here.
  void for_each(int count, const std::function<void(int)>& body) const;

  /// The same with body(i, worker): `worker` in [0, threads()) is that of no other body at the same time, as the index
  /// of memory to work in.
  void for_each_with_worker(int count, const std::function<void(int, int)>& body) const;

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

}  // namespace esim

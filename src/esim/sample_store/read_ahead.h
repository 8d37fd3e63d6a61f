#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

// Private to sample_store.
namespace esim::inline sample_store {

/// A thread that reads items before they are needed.
template <typename Item>
class ReadAhead {
 public:
  /// `read` fills an item, whose memory it can reuse; it returns false at the end, and can throw. At most `count` items
  /// wait.
  ReadAhead(std::function<bool(Item&)> read, std::size_t count)
      : read_(std::move(read)), unused_(count), thread_([this] { work(); }) {}

  ~ReadAhead() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// Replaces `item` by the next one, and reuses its memory; false at the end. Throws what `read` threw.
  bool next(Item& item) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty() || ended_; });
    if (waiting_.empty()) {
      if (failure_) std::rethrow_exception(failure_);
      return false;
    }
    std::swap(item, waiting_.front());
    unused_.push_back(std::move(waiting_.front()));
    waiting_.pop_front();
    changed_.notify_all();
    return true;
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return !unused_.empty() || stopping_; });
      if (stopping_) return;
      Item item = std::move(unused_.back());
      unused_.pop_back();
      lock.unlock();
      bool read = false;
      std::exception_ptr failure;
      try {
        read = read_(item);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      if (read) waiting_.push_back(std::move(item));
      ended_ = !read;
      failure_ = failure;
      changed_.notify_all();
      if (ended_) return;
    }
  }

  std::function<bool(Item&)> read_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Item> unused_;
  std::deque<Item> waiting_;
  bool ended_ = false, stopping_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace esim::inline sample_store

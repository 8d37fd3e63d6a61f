#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "esim/recording/record.h"

namespace esim::inline recording {

/// Passes everything to another sink on a separate thread, so that compressing and writing do not hold up the
/// simulation. Records are copied. At most `capacity_bytes` of them wait; write() blocks while more are waiting. A
/// failure of the inner sink is thrown by the next call.
class BackgroundSink final : public Sink {
 public:
  explicit BackgroundSink(std::unique_ptr<Sink> inner, std::size_t capacity_bytes = std::size_t{64} << 20);
  ~BackgroundSink() override;

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;

  /// Returns when the inner sink has ended.
  void end(bool complete) override;

 private:
  struct Job {
    std::function<void(Sink&)> run;
    std::size_t bytes = 0;
  };

  void submit(Job job);
  void work();
  void stop();

  std::unique_ptr<Sink> inner_;
  std::size_t capacity_bytes_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;  // guarded by mutex_, like all below
  std::size_t waiting_bytes_ = 0;
  bool stopping_ = false;  // no more jobs will come
  std::exception_ptr failure_;

  std::thread thread_;
};

}  // namespace esim::inline recording

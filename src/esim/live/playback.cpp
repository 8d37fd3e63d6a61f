#include "esim/live/playback.h"

#include <algorithm>

namespace esim::inline live {
namespace {

constexpr std::chrono::milliseconds kLate{100};

std::chrono::nanoseconds wall_time(TimeNs simulated, double speed) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(static_cast<double>(simulated) / speed));
}

}  // namespace

/// From now on, simulated time advances with the wall clock from where it is. Needs the mutex.
void Playback::anchor() {
  anchor_ = now_;
  anchor_wall_ = Clock::now();
}

void Playback::begin(TimeNs start) {
  const std::lock_guard lock(mutex_);
  now_ = measured_from_ = start;
  measured_wall_ = Clock::now();
  if (order_ == Order::restart) order_ = Order::go_on;
  if (stepping_) stepping_ = false, paused_ = true;
  anchor();
}

Playback::Order Playback::wait_until(TimeNs now) {
  std::unique_lock lock(mutex_);
  now_ = std::max(now_, now);
  const auto since = Clock::now() - measured_wall_;
  if (since >= std::chrono::seconds(1)) {
    factor_ = to_seconds(now_ - measured_from_) / std::chrono::duration<double>(since).count();
    measured_from_ = now_, measured_wall_ = Clock::now();
  }
  if (stepping_ && now_ >= pause_at_) stepping_ = false, paused_ = true;
  while (order_ == Order::go_on) {
    if (paused_ && !stepping_) {
      changed_.wait(lock);
      continue;
    }
    if (speed_ <= 0) break;
    const auto due = anchor_wall_ + wall_time(now_ - anchor_, speed_);
    const auto late = Clock::now() - due;
    if (late > kLate) anchor();
    if (late >= Clock::duration::zero()) break;
    changed_.wait_until(lock, due);
  }
  return order_;
}

void Playback::set_paused(bool paused) {
  const std::lock_guard lock(mutex_);
  paused_ = paused, stepping_ = false;
  anchor();
  changed_.notify_all();
}

void Playback::set_speed(double speed) {
  const std::lock_guard lock(mutex_);
  speed_ = std::max(speed, 0.0);
  anchor();
  changed_.notify_all();
}

void Playback::step(double seconds) {
  const std::lock_guard lock(mutex_);
  stepping_ = true, paused_ = true;
  pause_at_ = now_ + to_ns(seconds);
  anchor();
  changed_.notify_all();
}

void Playback::restart() {
  const std::lock_guard lock(mutex_);
  if (order_ == Order::go_on) order_ = Order::restart;
  changed_.notify_all();
}

void Playback::stop() {
  const std::lock_guard lock(mutex_);
  order_ = Order::stop;
  changed_.notify_all();
}

bool Playback::paused() const {
  const std::lock_guard lock(mutex_);
  return paused_ && !stepping_;
}

double Playback::speed() const {
  const std::lock_guard lock(mutex_);
  return speed_;
}

TimeNs Playback::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

TimeNs Playback::due() const {
  const std::lock_guard lock(mutex_);
  if (speed_ <= 0 || (paused_ && !stepping_)) return now_;
  const std::chrono::duration<double> since = Clock::now() - anchor_wall_;
  return anchor_ + to_ns(since.count() * speed_);
}

double Playback::real_time_factor() const {
  const std::lock_guard lock(mutex_);
  return factor_;
}

}  // namespace esim::inline live

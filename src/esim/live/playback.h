#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "esim/core/time.h"

namespace esim::inline live {

/// The clock of a simulation that runs beside the wall clock: pause, step, speed, and beginning again. All functions
/// may be called from any thread.
class Playback {
 public:
  /// `speed`: simulated seconds per second; 0: as fast as possible.
  explicit Playback(double speed = 1) : speed_(speed) {}

  /// What the simulation does next.
  enum class Order { go_on, restart, stop };

  /// Waits until the simulated time `now` is due. A simulation that is late by more than a tenth of a second does not
  /// catch up: its clock moves.
  Order wait_until(TimeNs now);

  /// The simulation begins again at `start`.
  void begin(TimeNs start);

  void set_paused(bool paused);
  void set_speed(double speed);  ///< at least 0
  void step(double seconds);     ///< pauses `seconds` of simulated time later
  void restart();
  void stop();

  bool paused() const;
  double speed() const;

  /// How far the simulation is, and its speed during the last second.
  TimeNs now() const;
  double real_time_factor() const;

  /// The simulated time that is due now: how far the simulation should be. now() if it is paused or has no speed.
  TimeNs due() const;

 private:
  using Clock = std::chrono::steady_clock;

  void anchor();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  double speed_;
  bool paused_ = false;
  TimeNs now_ = 0, pause_at_ = 0;  // pause_at_: while a step is under way
  bool stepping_ = false;
  Order order_ = Order::go_on;

  // The simulated time anchor_ is due at anchor_wall_.
  TimeNs anchor_ = 0;
  Clock::time_point anchor_wall_ = Clock::now();

  TimeNs measured_from_ = 0;  // of real_time_factor()
  Clock::time_point measured_wall_ = Clock::now();
  double factor_ = 0;
};

}  // namespace esim::inline live

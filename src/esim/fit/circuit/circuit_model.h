#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "esim/event_camera/options.h"
#include "esim/fit/circuit/count_moments.h"
#include "esim/fit/circuit/pixel_counts.h"

// Private to fit.
namespace esim::inline fit {

/// The time constants of the circuit of a sensor on the bench, s.
struct TimeConstants {
  double photodiode = 0, follower = 0;

  TimeConstants(const CircuitOptions& c, double lux)
      : photodiode(c.photodiode_s(c.photocurrent_fa_per_lux * lux + c.dark_current_fa)),
        follower(c.source_follower_s()) {}

  double latency_s() const { return photodiode + follower; }
  /// -3 dB of both poles: (1 + w^2 t1^2) (1 + w^2 t2^2) = 2.
  double bandwidth_hz() const {
    const double a = photodiode * photodiode, b = follower * follower, sum = a + b;
    return std::sqrt((std::sqrt(sum * sum + 4 * a * b) - sum) / (2 * a * b)) / (2 * std::numbers::pi);
  }
};

/// The numbers of events of a sensor in the light of some recordings, by simulation, as a function of some parameters
/// of its circuit: `p` holds their logarithms.
class CircuitModel {
 public:
  enum Index : std::size_t { kOn, kOff, kPhotocurrent, kFollower, kCharge, kDark, kParameters };
  struct Effort {
    int lamp_side, noise_side;  ///< of the simulated sensor, px
    int points;                 ///< of the light of a lamp in a period
  };

  static double value(const EventCameraOptions& sensor, Index parameter);

  /// `recordings`: lamps come first. `recorded`: their moments, which say how long to simulate.
  CircuitModel(EventCameraOptions sensor, std::vector<Index> parameters, const std::vector<PixelCounts>& recordings,
               Eigen::VectorXd recorded);

  EventCameraOptions sensor_at(const Eigen::VectorXd& p) const;

  /// The same by formulas: within some 10 % under lamps that make more than one event in a period; noise_rate_hz() in
  /// constant light.
  Eigen::VectorXd approximate(const Eigen::VectorXd& p) const;

  /// At each point, with its seed. Lamps are seen by the same pixels, whose thresholds deviate alike.
  std::vector<CountMoments> simulate(const std::vector<Eigen::VectorXd>& points,
                                     const std::vector<std::uint64_t>& seeds, const Effort& effort) const;

  Index parameter(Eigen::Index place) const { return free_[static_cast<std::size_t>(place)]; }
  /// The place of a parameter; it must be one of those that vary.
  Eigen::Index place(Index parameter) const { return std::find(free_.begin(), free_.end(), parameter) - free_.begin(); }

  bool has_lamps() const { return used_.front().light.flickers(); }
  /// Whether a number belongs to a lamp, which come first.
  bool of_lamp(Eigen::Index number) const { return number < numbers_of_lamps_; }

 private:
  /// The place of a recording in the moments.
  Eigen::Index first_number(std::size_t recording) const;
  PixelCounts simulate_lamp(const EventCameraOptions& o, std::size_t recording, const Effort& effort,
                            std::uint64_t seed) const;
  PixelCounts simulate_noise(const EventCameraOptions& o, std::size_t recording, int side, std::uint64_t seed) const;
  CountMoments join(const std::vector<PixelCounts>& recordings) const;

  EventCameraOptions base_;
  std::vector<Index> free_;
  const std::vector<PixelCounts>& used_;
  Eigen::VectorXd recorded_;
  Eigen::Index numbers_of_lamps_ = 0;
};

}  // namespace esim::inline fit

#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "esim/geometry/se3.h"
#include "esim/live/publication.h"

namespace esim::inline live {

/// Where clients want the body to be. All functions may be called from any thread.
class PoseInput {
 public:
  explicit PoseInput(double max_jump_m) : max_jump_m_(max_jump_m) {}

  /// The body begins here; what clients wanted before is forgotten.
  void begin(const SE3& body);

  /// Takes a message on /esim/pose or /esim/twist; others are ignored. Messages that are malformed or not finite, and
  /// poses that are farther from the body than the largest jump, are counted and otherwise ignored.
  void take(const ClientMessage& message);

  /// The pose of the body `seconds` after `now`.
  SE3 next(const SE3& now, double seconds);

  std::int64_t taken() const;
  std::int64_t refused() const;

 private:
  struct Twist {
    Eigen::Vector3d linear, angular;
  };

  mutable std::mutex mutex_;
  double max_jump_m_;
  std::optional<SE3> pose_;     // the last one that came, unless a twist came later
  std::optional<Twist> twist_;  // likewise
  std::optional<SE3> body_;     // where it is
  std::int64_t taken_ = 0, refused_ = 0;
};

}  // namespace esim::inline live

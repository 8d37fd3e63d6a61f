#include "esim/scene/deformation/adapted.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline scene {
namespace {

constexpr TimeNs kForever = std::numeric_limits<TimeNs>::max() / 4;

class RetimedDeformation final : public Deformation {
 public:
  RetimedDeformation(std::shared_ptr<const Deformation> deformation, const AnimationClock& clock)
      : deformation_(std::move(deformation)), own_(deformation_->span()), clock_(clock) {}

  TimeSpan span() const override {
    if (own_.end <= own_.start) return {clock_.start, clock_.start};
    if (clock_.repeats) return {clock_.start, kForever};
    const double rest = static_cast<double>(std::max<TimeNs>(0, own_.end - own_.start - clock_.skipped));
    const double longest = static_cast<double>(kForever - std::max<TimeNs>(0, clock_.start));
    return {clock_.start, clock_.start + std::llround(std::min(rest * clock_.time_scale, longest))};
  }

  void evaluate(TimeNs t, DeformedVertices& vertices) const override {
    deformation_->evaluate(own_time(t), vertices);
    const bool rests = t < clock_.start || t >= span().end;
    const float rate = rests ? 0.0F : static_cast<float>(1 / clock_.time_scale);
    if (rate == 1) return;
    for (Eigen::Vector3f& velocity : vertices.velocities) velocity *= rate;
  }

 private:
  TimeNs own_time(TimeNs t) const {
    const double passed = static_cast<double>(std::max<TimeNs>(0, t - clock_.start)) / clock_.time_scale;
    const TimeNs length = own_.end - own_.start;
    if (clock_.repeats && length > 0) {
      const double since =
          std::fmod(passed, static_cast<double>(length)) + static_cast<double>(clock_.skipped % length);
      return own_.start + std::llround(since) % length;
    }
    const TimeNs since = clock_.skipped + std::llround(std::min(passed, static_cast<double>(kForever)));
    return own_.start + std::min(length, since);
  }

  std::shared_ptr<const Deformation> deformation_;
  TimeSpan own_;
  AnimationClock clock_;
};

class ScaledDeformation final : public Deformation {
 public:
  ScaledDeformation(std::shared_ptr<const Deformation> deformation, double factor)
      : deformation_(std::move(deformation)), factor_(static_cast<float>(factor)) {}

  TimeSpan span() const override { return deformation_->span(); }

  void evaluate(TimeNs t, DeformedVertices& vertices) const override {
    deformation_->evaluate(t, vertices);
    for (Eigen::Vector3f& position : vertices.positions) position *= factor_;
    for (Eigen::Vector3f& velocity : vertices.velocities) velocity *= factor_;
  }

 private:
  std::shared_ptr<const Deformation> deformation_;
  float factor_;
};

}  // namespace

std::shared_ptr<const Deformation> retimed(std::shared_ptr<const Deformation> deformation,
                                           const AnimationClock& clock) {
  return std::make_shared<const RetimedDeformation>(std::move(deformation), clock);
}

std::shared_ptr<const Deformation> scaled(std::shared_ptr<const Deformation> deformation, double factor) {
  return std::make_shared<const ScaledDeformation>(std::move(deformation), factor);
}

}  // namespace esim::inline scene

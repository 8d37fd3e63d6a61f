#include "esim/sampling/adaptive/error_budget.h"

#include <algorithm>
#include <cmath>

namespace esim::inline sampling {
namespace {

// Target fraction of the errors above the tolerance.
constexpr double kShareAbove = 0.01;

// Bounds of e_0 relative to its value for normally distributed errors.
constexpr double kMinGain = 0.25, kMaxGain = 2;

// An audit of a typical interval with all errors above the tolerance changes ln(e_0) by kFirstStep. The step decreases
// to kLastStep; it is halved after kHalvedAfter audits. The weight of a longer interval is at most kMaxWeight.
constexpr double kFirstStep = 1, kLastStep = 0.25, kHalvedAfter = 64, kMaxWeight = 4;

// Tiles in which no pixel changes by more than this fraction of the tolerance do not count.
constexpr double kActive = 0.25;

}  // namespace

ErrorLimits ErrorBudget::limits() const {
  constexpr double kP99OfNormal = 2.576;
  const double limit = gain_ * tolerance_, error = limit / kP99OfNormal;
  return {limit, error * error * typical_interval()};
}

double ErrorBudget::typical_interval() const { return intervals_ > 0 ? std::exp(log_intervals_ / intervals_) : 0; }

void ErrorBudget::remember(double log_intervals, int count) {
  constexpr double kMemory = 0.999;
  for (int i = 0; i < count; ++i) log_intervals_ *= kMemory, intervals_ *= kMemory;
  log_intervals_ += log_intervals, intervals_ += count;
}

void ErrorBudget::audit(std::span<const float> errors, float most_change, double duration) {
  std::size_t above = 0;
  for (const float value : errors) {
    const double error = std::fabs(static_cast<double>(value));
    audited_.add(error, duration);
    if (error > tolerance_) ++above;
  }
  if (static_cast<double>(most_change) <= kActive * tolerance_) return;
  const double excess = static_cast<double>(above) / static_cast<double>(errors.size()) - kShareAbove;
  const double weight = std::min(duration / typical_interval(), kMaxWeight);
  const double step = std::max(kLastStep, kFirstStep / (1 + steering_audits_++ / kHalvedAfter));
  gain_ = std::clamp(gain_ * std::exp(-step * weight * excess), kMinGain, kMaxGain);
}

}  // namespace esim::inline sampling

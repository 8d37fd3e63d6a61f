#include "esim/sampling/error_budget.h"

#include <algorithm>
#include <cmath>

namespace esim {
namespace {

// Where 99 % of the errors are not below this share of the tolerance, the limit becomes a lower one.
constexpr double kTarget = 0.9, kLeastGain = 0.25;

// Tiles in which no pixel changes by more than this share of the tolerance say nothing of errors.
constexpr double kActive = 0.25;

// So many audits make a measurement that the limit follows.
constexpr int kAuditsPerStep = 48;

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
  const bool active = static_cast<double>(most_change) > kActive * tolerance_;
  for (const float value : errors) {
    const double error = std::fabs(static_cast<double>(value));
    all_.add(error, duration);
    if (active) active_.add(error, duration);
  }
  if (active && ++active_audits_ == kAuditsPerStep) steer();
}

/// Follows what audits measured.
void ErrorBudget::steer() {
  const double wanted = kTarget * tolerance_ / std::max(active_.quantile(0.99), 1e-12);
  gain_ = std::clamp(gain_ * std::clamp(std::sqrt(wanted), 0.8, 1.25), kLeastGain, 1.0);
  active_ = LogHistogram();
  active_audits_ = 0;
}

}  // namespace esim

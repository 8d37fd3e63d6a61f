#pragma once

#include <variant>

#include "esim/core/describe.h"
#include "esim/core/parallel.h"
#include "esim/render/sample.h"

namespace esim {

/// Bounds on the interval between two samples, common to the criteria that adapt it.
struct RateBounds {
  double min_rate_hz = 50;
  double max_rate_hz = 50000;
};

/// Samples at a fixed rate: the k-th one k / rate_hz after the start.
struct UniformSampling {
  static constexpr const char* kType = "uniform";
  double rate_hz = 1000;
};

/// The brightness is expected to change by at most lambda C between two samples (paper, Eq. 2).
struct BrightnessSampling {
  static constexpr const char* kType = "brightness";
  double lambda = 0.5;
  RateBounds bounds;
};

/// A pixel is expected to move by at most lambda pixels between two samples (paper, Eq. 3).
struct FlowSampling {
  static constexpr const char* kType = "flow";
  double lambda = 0.5;
  RateBounds bounds;
};

using SamplingOptions = std::variant<FlowSampling, BrightnessSampling, UniformSampling>;

/// Properties of the event camera that a criterion may need.
struct SensorTraits {
  double contrast_threshold = 0.5;  ///< C of Eq. 2: the smaller one of C+ and C-
  double log_eps = 0.001;           ///< L = ln(E + log_eps)
};

/// Time until the next sample, s; +inf where the criterion sees no change.
double wanted_interval_s(const BrightnessSampling& options, const SensorTraits&, const Sample&, const Workers&);
double wanted_interval_s(const FlowSampling& options, const SensorTraits&, const Sample&, const Workers&);

/// Fastest motion in the image, max |V| over the pixels, px/s. Pixels whose motion is not finite do not count.
double fastest_motion_px_per_s(const Sample& sample, const Workers& workers);

/// Fastest expected change of brightness, max |dL/dt| = max |<grad L, V>| over the pixels (Eq. 1), 1/s.
double fastest_brightness_change_per_s(const Sample& sample, double log_eps, const Workers& workers);

template <class Visitor>
void describe(Visitor& visit, UniformSampling& o) {
  visit("rate_hz", o.rate_hz, About{"samples per second", "Hz", 0, 1e9, true});
}

template <class Visitor>
void describe(Visitor& visit, RateBounds& o) {
  visit("min_rate_hz", o.min_rate_hz, About{"least samples per second, also where nothing moves", "Hz", 0, 1e9, true});
  visit("max_rate_hz", o.max_rate_hz,
        About{"most samples per second, also where the criterion asks for more", "Hz", 0, 1e9, true});
}

template <class Visitor>
void describe(Visitor& visit, BrightnessSampling& o) {
  visit("lambda", o.lambda,
        About{"expected change of brightness between two samples, in contrast thresholds (Eq. 2)", "", 0, 1e6, true});
  describe(visit, o.bounds);
}

template <class Visitor>
void describe(Visitor& visit, FlowSampling& o) {
  visit("lambda", o.lambda, About{"expected motion between two samples (Eq. 3)", "px", 0, 1e6, true});
  describe(visit, o.bounds);
}

}  // namespace esim

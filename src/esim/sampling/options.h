#pragma once

#include <variant>

#include "esim/core/describe.h"

namespace esim::inline sampling {

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
  RateBounds bounds{};
};

/// A pixel is expected to move by at most lambda pixels between two samples (paper, Eq. 3).
struct FlowSampling {
  static constexpr const char* kType = "flow";
  double lambda = 0.5;
  RateBounds bounds{};
};

/// Samples each tile at its own times, so that the error of brightness between two samples stays below the tolerance.
struct AdaptiveSampling {
  static constexpr const char* kType = "adaptive";
  double tolerance = 0.25;
  double max_motion_px = 3;
  int tile_px = 32;
  RateBounds bounds{20, 50000};
};

/// Renders a few images with a denser camera, and reprojects them to the times in between.
struct KeyframeSampling {
  static constexpr const char* kType = "keyframes";
  double tolerance = 0.5;
  int supersampling = 0;
  int margin_px = 8;
  double max_displacement_px = 32;
  double lambda = 0.5;
  RateBounds bounds{2, 500};
};

using SamplingOptions =
    std::variant<FlowSampling, BrightnessSampling, UniformSampling, AdaptiveSampling, KeyframeSampling>;

template <class Visitor>
void describe(Visitor& visit, UniformSampling& o) {
  visit("rate_hz", o.rate_hz, About{"samples per second", "Hz", 0, 1e9, true});
}

template <class Visitor>
void describe(Visitor& visit, RateBounds& o) {
  visit("min_rate_hz", o.min_rate_hz,
        About{"minimum number of samples per second, also where nothing moves", "Hz", 0, 1e9, true});
  visit("max_rate_hz", o.max_rate_hz,
        About{"maximum number of samples per second, also where the criterion asks for more", "Hz", 0, 1e9, true});
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

template <class Visitor>
void describe(Visitor& visit, AdaptiveSampling& o) {
  visit("tolerance", o.tolerance,
        About{"bound that 99 % of the brightness errors between samples stay below, in contrast thresholds, where the "
              "brightness changes",
              "", 0, 1e6, true});
  visit(
      "max_motion_px", o.max_motion_px,
      About{"maximum expected motion between two samples, however little the brightness changes", "px", 0, 1e6, true});
  visit("tile_px", o.tile_px, About{"side of the tiles that are sampled independently", "px", 4, 1024});
  describe(visit, o.bounds);
}

template <class Visitor>
void describe(Visitor& visit, KeyframeSampling& o) {
  visit(
      "tolerance", o.tolerance,
      About{
          "maximum difference between the images that two keyframes predict between them, in contrast thresholds, over "
          "blocks of 8 x 8 pixels; a third keyframe is rendered where the difference is larger",
          "", 0, 1e6, true});
  visit("supersampling", o.supersampling,
        About{"keyframe pixels per sensor pixel, along each side; 0: as many, from 2 to 4, as the tolerance "
              "requires",
              "", 0, 4});
  visit("margin_px", o.margin_px, About{"margin of a keyframe around the sensor's image", "px", 0, 1024});
  visit("max_displacement_px", o.max_displacement_px,
        About{"maximum expected motion between two keyframes", "px", 1, 1024});
  visit("lambda", o.lambda, About{"expected motion between two reconstructed images", "px", 0, 1e6, true});
  describe(visit, o.bounds);
}

}  // namespace esim::inline sampling

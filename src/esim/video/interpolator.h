#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "esim/core/describe.h"
#include "esim/core/parallel.h"
#include "esim/scene/planes.h"
#include "esim/video/frame_interpolator.h"
#include "esim/video/frame_sequence.h"
#include "esim/video/optical_flow.h"

namespace esim::inline video {

struct InterpolationOptions {
  bool interpolation = true;
  double lambda = 0.5;
  int max_steps = 200;
};

template <class Visitor>
void describe(Visitor& visit, InterpolationOptions& o) {
  visit("interpolation", o.interpolation, About{"interpolate along the motion between frames"});
  visit("lambda", o.lambda, About{"maximum motion in a step between frames", "px", 0, 1000, true});
  visit("max_steps", o.max_steps, About{"maximum number of steps between two frames, whatever the motion", "", 1, 1e6});
}

/// How many of the pixels that change between two frames the optical flow follows. A pixel changes if its brightness
/// ln(E + log_eps) differs by more than 0.2. The flow follows it if it is found there, and leads from the pixel in
/// frame 0 to a point whose brightness in frame 1 differs by less than half as much, or by less than 0.5, which noise
/// and aliased texture explain.
struct FollowedPixels {
  std::int64_t changed = 0, followed = 0;
};

/// Interpolates the brightness between two frames of a video. With the displacements u forward from frame 0 and v
/// backward from frame 1, the content of a pixel at the fraction s between the frames is at
///   d0 = (s² - s)/2 u + (s² + s)/2 v   from it in frame 0, and at
///   d1 = (r² + r)/2 u + (r² - r)/2 v   from it in frame 1,  r = 1 - s:
/// the parabola through v, 0 and u, exact for steady motion along curves of constant acceleration. The values of both
/// frames at these points are blended linearly in ln(E + log_eps). If they differ by more than the pixel's own values
/// in the two frames, the motion does not explain the change, and the pixel's own values are blended instead. s = 0 and
/// s = 1 give the frames. A FrameInterpolator can make the images instead; the number of steps follows from the optical
/// flow also then.
class Interpolator {
 public:
  Interpolator(const InterpolationOptions& options, double log_eps, std::unique_ptr<FrameInterpolator> images = nullptr)
      : options_(options), log_eps_(log_eps), images_(std::move(images)) {}

  /// Takes the next frame; all frames must have the same size and number of planes. Afterwards frames 0 and 1 are the
  /// previous frame and this one.
  void advance(const Frame& frame, const Workers& workers);

  /// Number of steps between the frames such that no pixel moves by more than lambda in any step.
  int steps() const { return steps_; }

  /// Maximum speed of any pixel, px per frame.
  double max_flow_px() const { return max_flow_px_; }

  /// Whether max_steps limits steps().
  bool is_held() const { return held_; }

  /// Nothing without interpolation.
  const FollowedPixels& followed_pixels() const { return followed_; }

  /// Irradiance at the fraction in [0, 1] between frames 0 and 1; in (0, 1) with a FrameInterpolator. Throws UserError,
  /// with the time of the image, if that fails or its image is invalid.
  void at(double fraction, const Workers& workers, Planes& light) const;

 private:
  /// ln(E + log_eps) with a border of repeated pixels that contains every neighbourhood.
  struct PaddedLog {
    void assign(const Image<float>& light, float log_eps, const Workers& workers);
    const float* row(int y) const { return pixels.row(y + 1) + 1; }
    Image<float> pixels;
  };

  void measure_motion(const Planes& frame, const Workers& workers);
  void choose_steps(const Workers& workers);
  void count_followed(const Workers& workers);
  void ask_for_image(double fraction, Planes& light) const;
  void interpolate_row(int y, float fraction, std::size_t plane, float* light) const;

  InterpolationOptions options_;
  double log_eps_;
  std::unique_ptr<FrameInterpolator> images_;
  Frame frame0_, frame1_;                  // only for images_
  std::vector<PaddedLog> before_, after_;  // one per plane; only without images_
  Image<float> luminance_before_, luminance_after_;
  FlowField forward_, backward_;
  std::unique_ptr<OpticalFlow> optical_flow_;
  int steps_ = 1;
  double max_flow_px_ = 0;
  FollowedPixels followed_;
  bool held_ = false;
};

}  // namespace esim::inline video

#pragma once

#include <cstdint>
#include <optional>

#include "esim/core/parallel.h"
#include "esim/render/renderer.h"
#include "esim/truth/bearings.h"

namespace esim {

/// Optical flow over an interval: where what a camera sees at t0 is at t1.
struct Displacement {
  TimeNs t0 = 0, t1 = 0;

  // From the pixel's centre at t0 to the image of the same point of the scene at t1, px, to the right and downwards;
  // also where something hides it then, and outside the image. NaN where the camera has no image of it.
  Image<float> x, y;

  // 1 where the camera sees the point at t1 as well; 0 where it is hidden then, or outside the image.
  Image<std::uint8_t> visible;
};

/// Displacements between consecutive frames of one camera, from their depth, poses and objects, through the lens. A
/// pixel of depth Z and bearing b that sees the object O (or what stands still, whose pose stays) moves to
///     project(T_C_W(t1) T_W_O(t1) T_O_W(t0) T_W_C(t0) Z b).
/// The point is hidden where, in units of 1 / depth, the frame at t1 shows something nearer at the pixel it falls into,
/// by more than depth changes within half a pixel there and 0.5 %. So at an edge, a point is seen if the nearest
/// pixel's centre sees that side of it.
class DisplacementField {
 public:
  DisplacementField(const Camera& camera, const Workers& workers);

  /// Takes the next frame of the whole image: `sample` as rendered for `view`. Returns the displacement from the frame
  /// before to this one, valid until the next call; null for the first frame.
  const Displacement* advance(const RenderRequest& view, const Sample& sample);

 private:
  struct Frame {
    RenderRequest view;
    Image<float> depth;
    Image<std::uint16_t> object;
  };

  void compute(const Frame& from, const RenderRequest& to, const Image<float>& depth_there);

  Camera camera_;
  Image<Eigen::Vector2d> bearings_;
  const Workers& workers_;
  std::optional<Frame> before_;
  Displacement displacement_;
};

}  // namespace esim

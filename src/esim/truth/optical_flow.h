#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "esim/core/parallel.h"
#include "esim/core/state_archive.h"
#include "esim/render/deforming_surfaces.h"
#include "esim/render/renderer.h"
#include "esim/truth/bearings.h"

namespace esim::inline truth {

/// Optical flow of a camera from time t0 to t1.
struct OpticalFlowImages {
  TimeNs t0 = 0, t1 = 0;

  // From the pixel's centre at t0 to the image of the same scene point at t1, px, to the right and downwards; also
  // defined if the point is hidden then or outside the image. NaN if the camera does not project the point.
  Image<float> x, y;

  // 1 if the camera also sees the point at t1; 0 if it is hidden then or outside the image.
  Image<std::uint8_t> visible;
};

/// Computes the optical flow between consecutive frames of one camera from depth, poses, objects and lens. A pixel of
/// depth Z and bearing b that sees the object O (constant pose for the static scene) moves to
///     project(T_C_W(t1) T_W_O(t1) T_O_W(t0) T_W_C(t0) Z b).
/// The surface of a deforming object also moves in O, by the difference of the point's positions at t1 and t0.
/// The point is hidden if the frame at t1 shows a nearer surface at the point's pixel: if 1 / depth differs by more
/// than its change within half a pixel plus 0.5 %. So at an edge, a point is visible if the centre of the nearest pixel
/// sees the same side of the edge.
class OpticalFlowFromDepth {
 public:
  /// `surfaces`: of the deforming objects; null if all objects are rigid.
  OpticalFlowFromDepth(const Camera& camera, std::shared_ptr<const DeformingSurfaces> surfaces, const Workers& workers);

  /// Takes the next frame, a `sample` of the whole image rendered for `view`. Returns the optical flow from the
  /// previous frame to this one, valid until the next call; null for the first frame.
  const OpticalFlowImages* advance(const RenderRequest& view, const Sample& sample);

  /// The previous frame, for restore() of an object for the same camera.
  void save(StateWriter& archive) const;
  /// `view_at`: the views of the camera.
  void restore(StateReader& archive, const std::function<RenderRequest(TimeNs)>& view_at);

 private:
  struct Frame {
    RenderRequest view;
    Image<float> depth;
    Image<std::uint16_t> object;
    Image<SurfacePoint> surface;
  };

  void compute(const Frame& from, const RenderRequest& to, const Image<float>& depth_there);
  void find_displacements(const Frame& from, TimeNs to);

  Camera camera_;
  std::shared_ptr<const DeformingSurfaces> surfaces_;
  Image<Eigen::Vector2d> bearings_;
  const Workers& workers_;
  std::optional<Frame> before_;
  OpticalFlowImages optical_flow_;
  Image<Eigen::Vector3f> displacement_;  // of surfaces in the frames of their objects; empty if all are rigid
};

}  // namespace esim::inline truth

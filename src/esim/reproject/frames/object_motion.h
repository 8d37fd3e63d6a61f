#pragma once

#include <vector>

#include "esim/core/parallel.h"
#include "esim/reproject/frames/posed_frame.h"
#include "esim/reproject/keyframe.h"

namespace esim::inline reproject {

/// The rigid motions of objects between two frames.
struct ObjectMotions {
  /// Of each object: its pose in the world at both frames. The object's frame is parallel to the world's at the later
  /// frame, and its origin is then in the middle of the object's visible points.
  std::vector<SE3> then, now;

  Image<std::uint16_t> object_then, object_now;  ///< in the pixels of both frames: 0: static scene, i + 1: object i
  double moving = 0;     ///< fraction of the pixels whose motion vectors contradict the motion of the camera
  double not_rigid = 0;  ///< fraction of the pixels whose motion vectors fit to none of these motions
};

/// Finds them from the motion vectors of the later frame, `now`, which contradict the motion of the camera where an
/// object moves. If `now` has objects, each of them is one; otherwise, each connected part of the image that moves
/// differently. The six parameters of an object's motion minimise the distances (Huber's, in pixels) between where its
/// points were in the image and where their motion vectors begin (Gauss-Newton steps with Levenberg's damping).
ObjectMotions find_object_motions(const KeyframeLayout& layout, const PixelRays& rays, const PosedFrame& then,
                                  const PosedFrame& now, const Workers& workers);

}  // namespace esim::inline reproject

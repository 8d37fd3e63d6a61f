#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/reproject/keyframe.h"
#include "esim/reproject/parts.h"

namespace esim::inline reproject {

/// The surfaces that a view sees of the keyframes' points.
struct VisibleSurface {
  Image<float> nearness;      ///< 1/Z in the view; kNothing without a point
  Image<std::uint16_t> part;  ///< as in SurfacePoints; not current if nothing moves
  Image<Edge> edge;           ///< as in SurfacePoints; a crease marks only the pixel of its point

  static constexpr float kNothing = -1.0F;

  /// Adapts the images to a view; `moves`: something moves in it.
  void resize(int width, int height, bool moves);
};

/// Points that were seen from another view.
struct SeenPoints {
  const SurfacePoints& points;
  const std::vector<ViewChange>& changes;  ///< to this view, by part
};

/// Projects points of keyframes into a view, each onto up to four pixels around its image; the nearest point remains.
class DepthSplat {
 public:
  /// `camera`: of the view, whose pixels are `scale` keyframe pixels wide. `greatest_radius`: limit of the bearings
  /// that its lens maps.
  DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers);

  /// `moves`: anything moves but the camera.
  void splat(const std::vector<SeenPoints>& keyframes, bool moves, VisibleSurface& surface);

 private:
  static constexpr int kChunk = 32;     // points that are skipped together if none falls into the rows of a thread
  static constexpr int kRun = 1024;     // points per task of a parallel loop
  static constexpr int kBandRows = 16;  // rows of the view per task of a parallel loop

  void resize(int points);
  void throw_run(const SurfacePoints& points, const std::vector<ViewChange>& changes, int begin, int end);
  void collect(const SurfacePoints& points, int begin, int end, VisibleSurface& surface) const;

  Camera camera_;
  float scale_;
  double greatest_radius_;
  const Workers& workers_;
  std::vector<float> column_, row_, inverse_z_;  // image of each point, and 1 / y_z
  std::vector<float> first_row_, last_row_;      // of the points in each chunk
};

}  // namespace esim::inline reproject

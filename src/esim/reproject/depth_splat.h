#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/reproject/keyframe.h"

namespace esim::inline reproject {

/// Transforms points from one view to another: for a bearing b and a nearness w = 1/Z in the first view, y = R b + w t
/// is the point in the second view divided by Z; it appears at y / y_z with the nearness w / y_z. w = 0 is infinity.
struct ViewChange {
  Eigen::Matrix3f R;
  Eigen::Vector3f t;
};

/// The changes from view `from` to view `to`: [0] for the static scene, [i + 1] for object i.
std::vector<ViewChange> view_changes(const RenderRequest& from, const RenderRequest& to);

/// The surfaces that a view sees of the keyframes' points.
struct VisibleSurface {
  Image<float> nearness;        ///< 1/Z in the view; kNothing without a point
  Image<std::uint16_t> object;  ///< as in SurfacePoints; not current if nothing moves
  Image<Edge> edge;             ///< as in SurfacePoints; a crease marks only the pixel of its point

  static constexpr float kNothing = -1.0F;

  /// Adapts the images to a view; `objects`: something moves in it.
  void resize(int width, int height, bool objects);
};

/// Points, and the view from which they were seen.
struct SeenPoints {
  const RenderRequest& view;
  const SurfacePoints& points;
};

/// Projects points of keyframes into a view, each onto up to four pixels around its image; the nearest point remains.
class DepthSplat {
 public:
  /// `camera`: of the view, whose pixels are `scale` keyframe pixels wide. `greatest_radius`: limit of the bearings
  /// that its lens maps.
  DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers);

  void splat(const std::vector<SeenPoints>& keyframes, const RenderRequest& view, VisibleSurface& surface);

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

#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/reproject/keyframe.h"

namespace esim {

/// Takes points of one view to another: of a bearing b and a nearness w = 1/Z there, y = R b + w t is Z^-1 times the
/// point here, so that it appears at y / y_z and has the nearness w / y_z. w = 0 is infinitely far.
struct ViewChange {
  Eigen::Matrix3f R;
  Eigen::Vector3f t;
};

/// From view `from` to view `to`: of what stands still at [0], of object i at [i + 1].
std::vector<ViewChange> view_changes(const RenderRequest& from, const RenderRequest& to);

/// What a view would see of keyframes' points.
struct VisibleSurface {
  Image<float> nearness;        ///< 1/Z in the view; kNothing where no point falls
  Image<std::uint16_t> object;  ///< as in SurfacePoints; where nothing moves, not current
  Image<Edge> edge;             ///< as in SurfacePoints; a crease in the one pixel that its point falls into

  static constexpr float kNothing = -1.0F;

  /// Makes it one of a view in which, with `objects`, something moves, where it is not yet.
  void resize(int width, int height, bool objects);
};

/// Points, and the view that they were seen from.
struct SeenPoints {
  const RenderRequest& view;
  const SurfacePoints& points;
};

/// Throws points of keyframes into a view, each onto the up to four pixels around where it falls; the nearest stays.
class DepthSplat {
 public:
  /// `camera`: of the view, whose pixels are `scale` of the keyframes' pixels wide. `greatest_radius`: of bearings
  /// that its lens takes.
  DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers);

  void splat(const std::vector<SeenPoints>& keyframes, const RenderRequest& view, VisibleSurface& surface);

 private:
  static constexpr int kChunk = 32;     // points that are skipped together where none of them falls into a band
  static constexpr int kRun = 1024;     // points that one thread throws
  static constexpr int kBandRows = 16;  // rows of the view that one thread fills

  void resize(int points);
  void throw_run(const SurfacePoints& points, const std::vector<ViewChange>& changes, int begin, int end);
  void collect(const SurfacePoints& points, int begin, int end, VisibleSurface& surface) const;

  Camera camera_;
  float scale_;
  double greatest_radius_;
  const Workers& workers_;
  std::vector<float> column_, row_, inverse_z_;  // where each point falls, and 1 / y_z there
  std::vector<float> first_row_, last_row_;      // of the points of each chunk
};

}  // namespace esim

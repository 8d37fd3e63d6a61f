#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
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

/// Projects points of keyframes into a view, each onto up to four pixels around its image; the nearest point remains,
/// and the first one of equally near ones.
class DepthSplat {
 public:
  /// `camera`: of the view, whose pixels are `scale` keyframe pixels wide. `greatest_radius`: limit of the bearings
  /// that its lens maps.
  DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers);

  /// Throws UserError if the keyframes have 2^30 points or more.
  void splat(const std::vector<SeenPoints>& keyframes, const RenderRequest& view, VisibleSurface& surface);

 private:
  static constexpr int kChunk = 32;  // points that are skipped together if none falls into the rows of a thread
  static constexpr int kChunksOfRun = 32, kRun = kChunk * kChunksOfRun;  // points per task of a parallel loop
  static constexpr int kBandRows = 16;                                   // rows of the view per task of a parallel loop

  /// The rows into which points fall.
  struct Rows {
    float first, last;
  };

  /// The points of a keyframe in the view.
  struct Projected {
    std::vector<float> column, row, inverse_z;  // image of each point, and 1 / y_z
    std::vector<Rows> chunks, runs;
    std::uint32_t before = 0;  // points of the keyframes before
  };

  /// The nearest point in each pixel of some rows, with a border of one pixel: the bits of its nearness above those of
  /// its rank, which is larger for earlier points, and of its edge; 0 without a point. The larger number is in front.
  using Band = std::vector<std::uint64_t>;

  void project(const SurfacePoints& points, const std::vector<ViewChange>& changes, int run,
               Projected& projected) const;
  void collect(const SurfacePoints& points, const Projected& projected, int begin, int end, Band& band) const;
  void collect_chunk(const SurfacePoints& points, const Projected& projected, std::size_t first, int begin, int end,
                     Band& band) const;
  std::uint16_t object_of(const std::vector<SeenPoints>& keyframes, std::uint32_t point) const;
  void show(const std::vector<SeenPoints>& keyframes, bool objects, const Band& band, int begin, int end,
            VisibleSurface& surface) const;

  Camera camera_;
  float scale_;
  double greatest_radius_;
  const Workers& workers_;
  std::vector<Projected> projected_;  // per keyframe
  std::vector<Band> bands_;           // per thread
};

}  // namespace esim::inline reproject

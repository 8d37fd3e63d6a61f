#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
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

/// Projects points of keyframes into a view, each onto up to four pixels around its image; the nearest point remains,
/// and the first one of equally near ones.
class DepthSplat {
 public:
  /// `camera`: of the view, whose pixels are `scale` keyframe pixels wide. `greatest_radius`: limit of the bearings
  /// that its lens maps.
  DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers);

  /// `moves`: something moves in the view. Throws UserError if the keyframes have 2^30 points or more.
  void splat(const std::vector<SeenPoints>& keyframes, bool moves, VisibleSurface& surface);

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
  std::uint16_t part_of(const std::vector<SeenPoints>& keyframes, std::uint32_t point) const;
  void show(const std::vector<SeenPoints>& keyframes, bool moves, const Band& band, int begin, int end,
            VisibleSurface& surface) const;

  Camera camera_;
  float scale_;
  double greatest_radius_;
  const Workers& workers_;
  std::vector<Projected> projected_;  // per keyframe
  std::vector<Band> bands_;           // per thread
};

}  // namespace esim::inline reproject

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "esim/backends/splats/projected_cluster.h"
#include "esim/backends/splats/splat_scene.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

// Private to backends/splats.
namespace esim::inline backends::inline splats {

/// Opacities between these fade to zero. In models, splats end at 1/255.
inline constexpr float kFadeFrom = 1.5F / 255, kInvisible = 0.5F / 255;

/// A splat ends within this number of standard deviations: sqrt(2 ln(1 / kInvisible)).
inline constexpr float kReach = 3.54F;

/// Nearer splats are invisible, and splats fade up to twice this depth; m.
inline constexpr float kNearest = 0.01F;

/// A camera, relative to a group of splats.
struct SplatView {
  SplatView(const RenderRequest& request, std::size_t object, const Eigen::Quaterniond& to_object);

  Eigen::Matrix3f R_camera_group;

  /// Position of the camera in the group's frame: the sum of both, since floats are too coarse for slow motion.
  Eigen::Vector3f position, position_remainder;
};

/// A rectangle of bearings: x to the right, y downwards, z = 1.
struct BearingRect {
  float left, right, top, bottom;

  bool overlaps(const BearingRect& other) const {
    return left <= other.right && other.left <= right && top <= other.bottom && other.top <= bottom;
  }
};

/// Projects splats to the image of a camera.
class Projector {
 public:
  /// `footprint`: side of the square that pixels average over, px.
  Projector(const Camera& camera, SplatProjection projection, float footprint);

  /// Bearings outside which nothing of a cluster is visible; empty (left > right) if it is behind the camera.
  BearingRect bounds(const SplatCluster& cluster, const SplatView& view) const;

  /// Projects the splats of a cluster. `object` as in ScreenSplat.
  void project(const SplatGroup& group, const SplatCluster& cluster, const SplatView& view, float object,
               ProjectedCluster& projected) const;

 private:
  template <class Lens>
  void project_through(const Lens& lens, const SplatGroup& group, const SplatCluster& cluster, const SplatView& view,
                       float object, ProjectedCluster& projected) const;

  Camera camera_;
  bool linear_;
  float area_;                       // square of the footprint, px²
  float domain_;                     // radius of the ideal points that the lens can show
  float limit_x_ = 0, limit_y_ = 0;  // of the bearings at which the Jacobian of a linear projection is taken
  float widest_ = 0;                 // the largest bearing in the image
  float stretch_ = 1;                // of uncertain size in unscented projections: at most
  float bearing_per_px_ = 0;         // at most
};

}  // namespace esim::inline backends::inline splats

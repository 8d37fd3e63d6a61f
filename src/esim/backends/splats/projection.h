#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "esim/backends/splats/projected_cluster.h"
#include "esim/backends/splats/splat_scene.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/scene/splats/splat_rules.h"

// Private to backends/splats.
namespace esim::inline backends::inline splats {

/// A splat ends within this number of standard deviations: sqrt(2 ln(1 / kInvisible)).
inline constexpr float kReach = 3.54F;

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

  BearingRect with(const BearingRect& other) const {
    return {std::min(left, other.left), std::max(right, other.right), std::min(top, other.top),
            std::max(bottom, other.bottom)};
  }
};

/// Per cluster, in m: a box around the centres in the camera frame, and how far splats reach beyond it; and the share
/// of the fine splats, as opposed to merged ones.
struct ClusterBoxes {
  std::array<std::vector<float>, 3> middle, half;
  std::vector<float> reach, fine;

  std::size_t size() const { return reach.size(); }
  void resize(std::size_t count);
  void append(const ClusterBoxes& other, std::size_t i);

  /// Finds the clusters of which something may be visible in the rectangle: 1, or 0 for the others.
  void find_visible(const BearingRect& rect, std::vector<std::uint8_t>& visible) const;
};

/// Projects splats to the image of a camera.
class Projector {
 public:
  /// `footprint`: side of the square that pixels average over, px. `grey`: the first colour of projected splats is
  /// their luminance.
  Projector(const Camera& camera, SplatProjection projection, float footprint, bool grey = false);

  /// The boxes of all clusters. Where merged splats are smaller than a pixel's filter, they replace the fine ones; the
  /// change is gradual.
  void find_boxes(const SplatScene::Placed& group, const SplatView& view, ClusterBoxes& boxes) const;

  /// The bearings at which a splat may be visible that is seen in the rectangle, because of the filter of the image.
  BearingRect widened(const BearingRect& rect) const {
    return {rect.left - margin_, rect.right + margin_, rect.top - margin_, rect.bottom + margin_};
  }

  /// Projects the splats of a cluster, with a share of their opacity: 1 - (1 - opacity)^share. `object` as in
  /// ScreenSplat.
  void project(const SplatGroup& group, const SplatRange& cluster, const SplatView& view, float share, float object,
               ProjectedCluster& projected) const;

 private:
  template <class Lens>
  void project_through(const Lens& lens, const SplatGroup& group, const SplatRange& cluster, const SplatView& view,
                       float share, float object, ProjectedCluster& projected) const;

  Camera camera_;
  bool linear_, grey_;
  float area_;                       // square of the footprint, px²
  float domain_;                     // radius of ideal points at which unscented points end
  float limit_x_ = 0, limit_y_ = 0;  // of the bearings at which the Jacobian of a linear projection is taken
  float reach_ = 0;                  // of a splat in the image, in standard deviations at its depth
  float margin_ = 0;                 // of the filter of the image, in bearings
  float px_per_bearing_ = 0;         // at most; pixels of the sensor
};

}  // namespace esim::inline backends::inline splats

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/reproject/frames/object_motion.h"
#include "esim/reproject/frames/pose_path.h"
#include "esim/reproject/frames/posed_frame.h"
#include "esim/reproject/reprojector.h"

namespace esim::inline reproject {

struct FrameReprojection {
  double lambda = 0.5;     ///< 99.9 % of the sensor's pixels move by no more between two reconstructions, px
  double log_eps = 0.001;  ///< of the sensor, for `disagreement`
};

/// What frames in between are made of, as a measure of their error.
struct FrameReprojectionStatistics {
  std::int64_t frames = 0, reconstructions = 0;
  double unseen = 0;        ///< fraction of the reconstructions' pixels that neither of the two frames sees
  double disagreement = 0;  ///< difference of L halfway between the latest two frames: see disagreement()

  // From motion vectors, of the latest frame.
  std::int64_t objects = 0;  ///< that move
  double moving = 0;         ///< fraction of its pixels whose motion is not that of the camera
  double not_rigid = 0;      ///< fraction of its pixels whose motion is that of no rigid object
};

/// Fills the time between frames of another simulator. Their pixels are moved along the known motion of camera and
/// objects, as between keyframes, instead of blending the frames.
class ReprojectedFrames {
 public:
  ReprojectedFrames(const KeyframeLayout& layout, const FrameReprojection& options, const Workers& workers);

  /// Takes the next frame, and gives `each` the segments of the sensor's irradiance since the previous one in order;
  /// the first frame gives an instant. Segments are valid during the call only. Throws UserError, without effect, for a
  /// frame that is not later than the previous one, and for images of another size.
  void take(PosedFrame frame, const std::function<void(const Segment&)>& each);

  const KeyframeLayout& layout() const { return reprojector_.layout(); }
  const FrameReprojectionStatistics& statistics() const { return statistics_; }

 private:
  struct Motion;
  class Correction;

  void require_valid(const PosedFrame& frame) const;
  void prepare(const PosedFrame& frame, bool with_objects, Keyframe& keyframe);
  Motion motion_to(PosedFrame& frame);
  std::optional<PoseAt> earlier_pose(const ObjectMotions& found, std::size_t object) const;
  Image<float> steps_px(const Keyframe& from, const Keyframe& to) const;
  Image<float> seen_by_sensor(const PosedFrame& frame) const;
  void fill(const Motion& motion, const PosedFrame& frame, const std::function<void(const Segment&)>& each);

  FrameReprojection options_;
  const Workers& workers_;
  PixelRays rays_;  // of the frames
  Reprojector reprojector_;
  std::optional<PosedFrame> last_;
  std::vector<PoseAt> earlier_;  // of the camera and of the objects, one frame before `last_`; empty before the third
  std::optional<ObjectMotions> found_;  // until `last_`, by motion vectors; without its images
  Keyframe before_, after_;             // of `last_` and of the frame that is taken
  Image<float> seen_;                   // by the sensor of `last_`
  Reconstruction begin_, end_, apart_;
  FrameReprojectionStatistics statistics_;
  double unseen_pixels_ = 0;
};

}  // namespace esim::inline reproject

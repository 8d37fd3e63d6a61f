#include "esim/reproject/frames/reprojected_frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "esim/reproject/disagreement.h"
#include "esim/reproject/frames/object_motion.h"
#include "esim/reproject/row_lookup.h"

namespace esim::inline reproject {
namespace {

constexpr double kMaxPerSecond = 50000;  // reconstructions, whatever the motion

// A reconstruction's error at the time of a frame is still its error until the image has moved by this much, px.
constexpr float kSameError_px = 1;

/// Of the finite values; 0 without any.
double quantile(const Image<float>& image, double share) {
  std::vector<float> values;
  for (const float value : image.pixels())
    if (std::isfinite(value)) values.push_back(value);
  if (values.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(rank)]);
}

}  // namespace

/// The motion of camera and objects from one frame to the next.
struct ReprojectedFrames::Motion {
  TimeNs begin, end;
  PosePath camera;
  std::vector<PosePath> objects;

  RenderRequest at(TimeNs t) const {
    RenderRequest view{.t = t, .camera = {.T_world_body = camera.at(t)}, .tiles = {}};
    for (const PosePath& object : objects) view.objects.push_back({.T_world_body = object.at(t)});
    return view;
  }
};

/// What the reconstructions between two frames have to be corrected by. At the time of a frame, the true image is
/// known. The difference fades as the image moves, and with the time to the other frame. So an image that hardly moves
/// is interpolated linearly in time, and resampling does not change it.
class ReprojectedFrames::Correction {
 public:
  /// `forth`, `back`: steps_px() between the frames; `true_end`: what the sensor sees at the later one.
  Correction(ReprojectedFrames& frames, const Motion& motion, const Image<float>& forth, const Image<float>& back,
             const Image<float>& true_end)
      : workers_(frames.workers_), begin_(frames.seen_), end_(true_end), fading_(true_end.width(), true_end.height()) {
    Reconstruction told;
    for (const auto& [t, difference] : {std::pair{motion.begin, &begin_}, {motion.end, &end_}}) {
      frames.reprojector_.reconstruct(frames.before_, frames.after_, motion.at(t), Detail::whole, told);
      for (std::size_t i = 0; i < difference->size(); ++i) difference->pixels()[i] -= told.irradiance.pixels()[i];
    }
    const int margin = frames.layout().margin_px;
    workers_.for_each(fading_.height(), [&](int y) {
      for (int x = 0; x < fading_.width(); ++x) {
        float fastest = kSameError_px;
        for (int v = std::max(y + margin - 1, 0); v <= std::min(y + margin + 1, forth.height() - 1); ++v)
          for (int u = std::max(x + margin - 1, 0); u <= std::min(x + margin + 1, forth.width() - 1); ++u)
            fastest = std::max({fastest, forth(u, v), back(u, v)});
        fading_(x, y) = fastest / kSameError_px;
      }
    });
  }

  /// Corrects the image at a fraction of the time between the frames.
  void apply(float share, Image<float>& image) const {
    workers_.for_each(image.height(), [&](int y) {
      for (int x = 0; x < image.width(); ++x) {
        const float w0 = std::max(0.0F, 1 - share * fading_(x, y)),
                    w1 = std::max(0.0F, 1 - (1 - share) * fading_(x, y));
        image(x, y) = std::max(0.0F, image(x, y) + w0 * begin_(x, y) + w1 * end_(x, y));
      }
    });
  }

 private:
  const Workers& workers_;
  Image<float> begin_, end_;  // true minus reconstructed
  Image<float> fading_;       // per fraction of the interval, at least 1
};

ReprojectedFrames::ReprojectedFrames(const KeyframeLayout& layout, const FrameReprojection& options,
                                     const Workers& workers)
    : options_(options), workers_(workers), rays_(layout.camera), reprojector_(layout, false, workers) {}

void ReprojectedFrames::require_valid(const PosedFrame& frame) const {
  const Camera& camera = layout().camera;
  const auto require_size = [&](const auto& image, const char* name) {
    if (image.width() != camera.width || image.height() != camera.height) {
      throw UserError(std::string(name) + ": has " + std::to_string(image.width()) + " x " +
                      std::to_string(image.height()) + " pixels; frames have " + std::to_string(camera.width) + " x " +
                      std::to_string(camera.height));
    }
  };
  require_size(frame.irradiance, "irradiance"), require_size(frame.depth, "depth");
  if (!frame.object.empty()) require_size(frame.object, "objects");
  if (!frame.motion_x.empty()) require_size(frame.motion_x, "motion"), require_size(frame.motion_y, "motion");
  if (last_ && frame.motion_x.empty() && frame.T_world_objects.size() < last_->T_world_objects.size())
    throw UserError("object_poses: has fewer objects than the previous frame");
  if (last_ && frame.t <= last_->t) {
    throw UserError("a frame at " + std::to_string(frame.t) + " ns is not later than the previous one, at " +
                    std::to_string(last_->t) + " ns");
  }
  if (frame.motion_x.empty()) {
    for (const std::size_t object : frame.object.pixels()) {
      if (object > frame.T_world_objects.size()) {
        throw UserError("objects: there is no pose of object " + std::to_string(object) + " of " +
                        std::to_string(frame.T_world_objects.size()));
      }
    }
  }
  for (const float e : frame.irradiance.pixels()) {
    if (!(e >= 0) || !std::isfinite(e))
      throw UserError("irradiance must be finite and at least 0, not " + std::to_string(e));
  }
}

void ReprojectedFrames::prepare(const PosedFrame& frame, bool with_objects, Keyframe& keyframe) {
  Sample sample;
  sample.depth = frame.depth;
  if (with_objects) sample.object = frame.object;
  RenderRequest view{.t = frame.t, .camera = {.T_world_body = frame.T_world_camera}, .tiles = {}};
  KeyframeLight light{.wide = {}, .narrow = frame.irradiance, .look_closely = layout().supersampling > 1};
  reprojector_.prepare(std::move(view), sample, std::move(light), keyframe);
}

void ReprojectedFrames::take(PosedFrame frame, const std::function<void(const Segment&)>& each) {
  require_valid(frame);
  ++statistics_.frames;
  if (!last_) {
    prepare(frame, false, before_);
    seen_ = end_.irradiance = seen_by_sensor(frame);
    const Camera& sensor = layout().sensor;
    each(Segment{{0, 0, sensor.width, sensor.height}, frame.t, frame.t, &end_.irradiance, &end_.irradiance});
  } else {
    fill(motion_to(frame), frame, each);
    before_ = std::move(after_);
    earlier_ = {{last_->t, last_->T_world_camera}};
    for (const SE3& object : last_->T_world_objects) earlier_.push_back({last_->t, object});
  }
  last_ = std::move(frame);
}

/// The motion from the last frame, and the keyframes with their objects.
ReprojectedFrames::Motion ReprojectedFrames::motion_to(PosedFrame& frame) {
  const TimeNs then = last_->t, now = frame.t;
  const auto path = [&](std::size_t body, const SE3& first, const SE3& second) {
    // A long time ago says nothing about the curvature now.
    const bool known = body < earlier_.size() && then - earlier_[body].t <= 2 * (now - then);
    const PoseAt begin{then, first}, end{now, second};
    return known ? PosePath(earlier_[body], begin, end) : PosePath(begin, end);
  };
  Motion motion{then, now, path(0, last_->T_world_camera, frame.T_world_camera), {}};
  bool other_objects = false;  // than those with which the last frame was prepared
  if (!frame.motion_x.empty()) {
    ObjectMotions found = find_object_motions(layout(), rays_, *last_, frame, workers_);
    statistics_.objects = static_cast<std::int64_t>(found.now.size());
    statistics_.moving = found.moving, statistics_.not_rigid = found.not_rigid;
    for (std::size_t i = 0; i < found.now.size(); ++i) {
      const PoseAt begin{then, found.then[i]}, end{now, found.now[i]};
      const std::optional<PoseAt> earlier = earlier_pose(found, i);
      motion.objects.push_back(earlier ? PosePath(*earlier, begin, end) : PosePath(begin, end));
    }
    last_->object = std::move(found.object_then), frame.object = std::move(found.object_now);
    found.object_then = found.object_now = {};
    found_ = std::move(found);
    other_objects = !motion.objects.empty();
  } else {
    for (std::size_t i = 0; i < frame.T_world_objects.size(); ++i) {
      const SE3& second = frame.T_world_objects[i];
      const bool is_new = i >= last_->T_world_objects.size();
      motion.objects.push_back(path(i + 1, is_new ? second : last_->T_world_objects[i], second));
    }
    for (PosedFrame* one : {&*last_, &frame})
      if (one->object.empty()) one->object = Image<std::uint16_t>(frame.depth.width(), frame.depth.height());
  }
  if (frame.motion_x.empty()) found_.reset();
  const bool has_objects = !motion.objects.empty();
  if (other_objects || has_objects == before_.sparse.part.empty()) prepare(*last_, has_objects, before_);
  prepare(frame, has_objects, after_);
  before_.view = motion.at(then), after_.view = motion.at(now);
  return motion;
}

/// Where an object was one frame before the last one: it moved like the object that was found in most of its pixels
/// then.
std::optional<PoseAt> ReprojectedFrames::earlier_pose(const ObjectMotions& found, std::size_t object) const {
  if (!found_ || earlier_.empty() || last_->object.size() != found.object_then.size()) return std::nullopt;
  std::vector<int> votes(found_->now.size() + 1);
  for (std::size_t i = 0; i < found.object_then.size(); ++i)
    if (found.object_then.pixels()[i] == object + 1) ++votes[last_->object.pixels()[i]];
  const auto most = static_cast<std::size_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
  if (most == 0 || votes[most] == 0) return std::nullopt;
  const SE3 moved = found_->then[most - 1] * found_->now[most - 1].inverse();
  return PoseAt{earlier_[0].t, moved * found.then[object]};
}

/// How far the point in each of the sensor's pixels moves from a frame to the other one, in these pixels; also in the
/// margin. Infinite if it does not get into the other camera's view.
Image<float> ReprojectedFrames::steps_px(const Keyframe& from, const Keyframe& to) const {
  constexpr double kAnywhere = 1e3;  // largest radius of bearings
  constexpr float kNowhere = -1e5F;
  const SurfacePoints& points = from.sparse;
  const std::vector<ViewChange> changes = view_changes(from.view, to.view), here = view_changes(from.view, from.view);
  RowLookup begins(static_cast<std::size_t>(points.size())), ends(begins.count);
  std::visit(
      [&](const auto& model) {
        const Projector project(layout().camera, model, kAnywhere);
        const auto part_at = [&](int i) { return points.part.empty() ? 0U : points.part[static_cast<std::size_t>(i)]; };
        for (int first = 0; first < points.size();) {
          int last = first + 1;
          while (last < points.size() && part_at(last) == part_at(first)) ++last;
          for (const auto& [change, row] : {std::pair{&here, &begins}, {&changes, &ends}}) {
            project_row(project, (*change)[part_at(first)], points.x.data(), points.y.data(), points.nearness.data(),
                        first, last, *row);
          }
          first = last;
        }
      },
      layout().camera.distortion);
  const KeyframeLayout& l = layout();
  Image<float> steps(l.sensor.width + 2 * l.margin_px, l.sensor.height + 2 * l.margin_px);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const float step =
        std::hypot(ends.u[i] - begins.u[i], ends.v[i] - begins.v[i]) / static_cast<float>(l.supersampling);
    steps.pixels()[i] = ends.u[i] > kNowhere && std::isfinite(step) ? step : std::numeric_limits<float>::infinity();
  }
  return steps;
}

/// The sensor's image of a frame.
Image<float> ReprojectedFrames::seen_by_sensor(const PosedFrame& frame) const {
  const KeyframeLayout& l = layout();
  const int s = l.supersampling, margin = s * l.margin_px;
  Image<float> seen(l.sensor.width, l.sensor.height);
  workers_.for_each(l.sensor.height, [&](int y) {
    for (int x = 0; x < l.sensor.width; ++x) {
      float sum = 0;
      for (int j = 0; j < s; ++j)
        for (int i = 0; i < s; ++i) sum += frame.irradiance(margin + s * x + i, margin + s * y + j);
      seen(x, y) = sum / static_cast<float>(s * s);
    }
  });
  return seen;
}

void ReprojectedFrames::fill(const Motion& motion, const PosedFrame& frame,
                             const std::function<void(const Segment&)>& each) {
  const TimeNs interval = motion.end - motion.begin;
  const RenderRequest middle = motion.at(motion.begin + interval / 2);
  reprojector_.reconstruct(before_, after_, middle, Detail::apart, apart_);
  statistics_.disagreement = disagreement(apart_, options_.log_eps);

  const Image<float> forth = steps_px(before_, after_), back = steps_px(after_, before_);
  const double moved = std::max(quantile(forth, 0.999), quantile(back, 0.999));
  const double most = std::min(to_seconds(interval) * kMaxPerSecond, static_cast<double>(interval));
  const auto steps = static_cast<TimeNs>(std::max(1.0, std::min(std::ceil(moved / options_.lambda), std::floor(most))));

  Image<float> true_end = seen_by_sensor(frame);
  std::optional<Correction> correction;  // of the images before the last, which is known
  if (steps > 1) correction.emplace(*this, motion, forth, back, true_end);
  const Camera& sensor = layout().sensor;
  TimeNs reached = motion.begin;
  for (TimeNs step = 1; step <= steps; ++step) {
    const double share = static_cast<double>(step) / static_cast<double>(steps);
    const TimeNs t = motion.begin + static_cast<TimeNs>(share * static_cast<double>(interval));
    std::swap(begin_, end_);
    if (step < steps) {
      reprojector_.reconstruct(before_, after_, motion.at(t), Detail::whole, end_);
      ++statistics_.reconstructions;
      unseen_pixels_ += static_cast<double>(end_.unseen);
      correction->apply(static_cast<float>(share), end_.irradiance);
    } else {
      end_.irradiance = true_end;
    }
    each(Segment{{0, 0, sensor.width, sensor.height}, reached, t, &begin_.irradiance, &end_.irradiance});
    reached = t;
  }
  seen_ = std::move(true_end);
  statistics_.unseen = unseen_pixels_ / (static_cast<double>(std::max<std::int64_t>(statistics_.reconstructions, 1)) *
                                         sensor.width * sensor.height);
}

}  // namespace esim::inline reproject

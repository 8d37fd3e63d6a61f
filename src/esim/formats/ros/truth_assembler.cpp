#include "esim/formats/ros/truth_assembler.h"

#include <limits>
#include <utility>

namespace esim::inline formats::ros {

TruthAssembler::Frame& TruthAssembler::begin(Part part, TimeNs t) {
  // Files of esim 0.1 may have the irradiance of a frame twice.
  const bool again = part == Part::irradiance && frame_.parts.count() == 1 && expected_.count() > 1;
  if (open_ && (frame_.t != t || (frame_.parts.test(index(part)) && !again))) end_frame();
  if (!open_) frame_.t = t, frame_.parts.reset(), open_ = true;
  frame_.parts.set(index(part));
  return frame_;
}

void TruthAssembler::end_frame() {
  if (!std::exchange(open_, false)) return;
  std::swap(frame_, ended_);
  waiting_ = true;
}

std::optional<Record> TruthAssembler::take(int camera) {
  if (is_complete()) end_frame();
  if (!std::exchange(waiting_, false)) return std::nullopt;

  Frame& frame = ended_;
  const auto has = [&](Part part) { return frame.parts.test(index(part)); };
  const bool geometry = has(Part::depth) || has(Part::flow);
  if (!geometry && !has(Part::irradiance)) return std::nullopt;
  if (!geometry) return ImageRecord{camera, frame.t, frame.irradiance};

  const Image<float>& known = has(Part::depth) ? frame.depth : frame.motion_x;
  const Image<float> unknown(known.width(), known.height(), std::numeric_limits<float>::quiet_NaN());
  if (!has(Part::irradiance)) frame.irradiance = unknown;
  if (!has(Part::depth)) frame.depth = unknown;
  if (!has(Part::flow)) frame.motion_x = frame.motion_y = unknown;
  if (!has(Part::pose)) frame.T_world_camera = SE3();
  return TruthRecord{camera,      frame.t,        frame.T_world_camera, frame.irradiance,
                     frame.depth, frame.motion_x, frame.motion_y};
}

}  // namespace esim::inline formats::ros

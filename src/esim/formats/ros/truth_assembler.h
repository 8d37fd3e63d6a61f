#pragma once

#include <bitset>
#include <optional>

#include "esim/recording/record.h"

namespace esim::inline formats::ros {

/// Combines the messages of one camera at one time, each of which is a part of the ground truth.
class TruthAssembler {
 public:
  enum class Part { irradiance, depth, flow, pose };

  struct Frame {
    TimeNs t = 0;
    std::bitset<4> parts{};
    Image<float> irradiance{}, depth{}, motion_x{}, motion_y{};
    SE3 T_world_camera{};
  };

  /// Announces messages of this part; a frame is complete when it has all announced parts.
  void expect(Part part) { expected_.set(index(part)); }

  /// The frame for a part at this time. Ends the previous frame if it has another time.
  Frame& begin(Part part, TimeNs t);

  /// Ends the frame even if parts are missing.
  void end() { end_frame(); }

  /// The complete or ended frame, once: a TruthRecord, an ImageRecord if only irradiance is known, or nothing. Missing
  /// images are NaN. Borrowed until the next call of begin().
  std::optional<Record> take(int camera);

  bool is_complete() const { return open_ && frame_.parts == expected_; }

 private:
  static std::size_t index(Part part) { return static_cast<std::size_t>(part); }
  void end_frame();

  std::bitset<4> expected_;
  Frame frame_, ended_;
  bool open_ = false, waiting_ = false;  // frame_ has parts; ended_ has not been taken
};

}  // namespace esim::inline formats::ros

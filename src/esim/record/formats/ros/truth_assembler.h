#pragma once

#include <bitset>
#include <optional>

#include "esim/record/record.h"

namespace esim::ros {

/// Puts together what one camera's messages say of one instant, each a part of the ground truth.
class TruthAssembler {
 public:
  enum class Part { irradiance, depth, flow, pose };

  struct Frame {
    TimeNs t = 0;
    std::bitset<4> parts{};
    Image<float> irradiance{}, depth{}, flow_x{}, flow_y{};
    SE3 T_world_camera{};
  };

  /// There are messages of this part; a frame is complete with those of all parts that there are.
  void expect(Part part) { expected_.set(index(part)); }

  /// Where to put a part of this time. Ends the frame before, if it is of another time.
  Frame& begin(Part part, TimeNs t);

  /// Ends the frame, although parts of it may be missing.
  void end() { end_frame(); }

  /// The frame that is complete or ended, once: a TruthRecord, an ImageRecord where irradiance is all that is known, or
  /// nothing. Missing images are NaN. Borrowed until the next call of begin().
  std::optional<Record> take(int camera);

  bool is_complete() const { return open_ && frame_.parts == expected_; }

 private:
  static std::size_t index(Part part) { return static_cast<std::size_t>(part); }
  void end_frame();

  std::bitset<4> expected_;
  Frame frame_, ended_;
  bool open_ = false, waiting_ = false;  // frame_ has parts; ended_ has not been taken
};

}  // namespace esim::ros

#pragma once

#include <span>
#include <vector>

#include "esim/frame_camera/options.h"

namespace esim::inline frame_camera {

/// The response f of a frame camera: from the signal to the level, both 1 at full scale (paper, Section 7.4).
class CameraResponse {
 public:
  /// Reads the file of a measured response. Throws UserError naming file and line if it is invalid.
  explicit CameraResponse(const ResponseOptions& options);

  /// level = f(signal) for each value. Values below 0 stay negative if the response is linear, and become 0 otherwise;
  /// values above 1 may stay above 1.
  void apply(std::span<float> signal) const;

  /// The signal for a level in [0, 1].
  double inverse(double level) const;

 private:
  struct Point {
    float signal, level;
  };

  ResponseOptions options_;
  std::vector<Point> points_;  // of a measured response
};

}  // namespace esim::inline frame_camera

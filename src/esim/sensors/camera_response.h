#pragma once

#include <span>
#include <vector>

#include "esim/sensors/frame_camera_options.h"

namespace esim {

/// The response f of a frame camera: from the signal, 1 at full scale, to the level, 1 likewise (paper, Section 7.4).
class CameraResponse {
 public:
  /// Reads the file of a measured response. Throws UserError with file and line where it is none.
  explicit CameraResponse(const ResponseOptions& options);

  /// level = f(signal) of each value. What is below 0 stays there if the response is linear, and becomes 0 otherwise;
  /// what is above 1 may stay above.
  void apply(std::span<float> signal) const;

  /// The signal at which the level is reached, for a level on [0, 1].
  double inverse(double level) const;

 private:
  struct Point {
    float signal, level;
  };

  ResponseOptions options_;
  std::vector<Point> points_;  // of a measured response
};

}  // namespace esim

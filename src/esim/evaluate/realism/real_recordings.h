#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/evaluate/realism/real_frame.h"
#include "esim/events/event.h"
#include "esim/stats/sensor/frame_times.h"
#include "esim/stats/sensor/integer_histogram.h"

// Private to evaluate.
namespace esim::inline evaluate {

/// A short recording of a real event camera that rotates, with what it saw: a frame, and how it moves.
struct RealClip {
  std::string name;
  std::vector<Event> events;  ///< from time 0 on
  double duration_s = 0;
  RealFrame frame;                   ///< at the middle of the complete recording
  Image<float> flow_x, flow_y;       ///< displacement of each pixel during the complete recording, px
  double start_s = 0;                ///< of this part, after the start of the complete recording
  double complete_s = 0;             ///< duration of the complete recording
  std::optional<FrameTimes> frames;  ///< when the chip took frames, found in the complete recording

  /// A rectangle of pixels.
  struct Region {
    int x = 0, y = 0, width = 0, height = 0;
  };

  /// The pixels that see only the inside of the frame during the complete recording. Throws UserError if there are
  /// none.
  Region region_inside() const;

  /// From one fraction of the duration to another.
  RealClip part(double from, double to) const;

  /// What the camera saw at a time (from 0 to duration_s, or beyond): the frame's scene displaced along the flow, from
  /// 0 to 1.
  Image<float> image_at(double s) const;
};

/// Reads `events.txt` (lines t x y p), `flow.npy` (1, 2, height, width; x, y; px, float64) and the only PNG file of a
/// folder, of the sensor's size or with the frame below another one in its left column, as in the excerpts of the Event
/// Camera Dataset at https://github.com/tub-rip/event_based_image_rec_inverse_problem. Times that are whole us but for
/// errors of a few ns become whole us. Throws UserError.
RealClip read_real_clip(const std::filesystem::path& folder);

/// Events of real pixels in constant light, for 10 s, as counts of intervals by rate: the files noise_pos_*lux.npy and
/// noise_neg_*lux.npy of https://github.com/neuromorphicsystems/IEBCS.
struct RealNoise {
  static constexpr double kDuration_s = 10;

  struct Polarity {
    IntegerHistogram counts;                 ///< events of a pixel
    std::vector<double> rates_hz, fraction;  ///< fraction of the intervals whose rate (1 / interval) is below
  };
  std::string name;
  double lux = 0;
  int width = 0, height = 0;
  Polarity on, off;
};

/// `positive`: the path of the file of ON events. Throws UserError.
RealNoise read_real_noise(const std::filesystem::path& positive);

/// Both kinds of recordings in a folder and the folders in it, by name.
struct RealRecordings {
  std::vector<RealClip> clips;
  std::vector<RealNoise> noise;
};
RealRecordings read_real_recordings(const std::filesystem::path& folder);

}  // namespace esim::inline evaluate

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "esim/record/format.h"

namespace esim {

// Formats of ground truth as files, one for each frame, in a folder: of one camera, without poses. Their readers give
// motion from frame to frame as DisplacementRecord, visible where it is known, and all else as TruthRecord.

/// `flo`: the Middlebury benchmark's optical flow from frame to frame.
Format flo_format();

/// `kitti`: KITTI's PNG of 16 bits, of optical flow from frame to frame in flow/ and of depth in depth/.
Format kitti_format();

/// `dsec-flow`: DSEC's PNG of 16 bits in forward/, and forward_timestamps.txt.
Format dsec_flow_format();

/// `exr`: OpenEXR files of irradiance, depth and motion field.
Format exr_format();

/// `npy-truth`: one NumPy array for everything of a kind, as in truth.h5.
Format npy_truth_format();

/// Optical flow from each frame of the first camera to the next, px: its displacements, and where a recording has none
/// between two frames of ground truth, the motion field of the first times the interval.
class FrameFlow {
 public:
  using Write = std::function<void(TimeSpan span, const Image<float>& x, const Image<float>& y)>;

  explicit FrameFlow(Write write) : write_(std::move(write)) {}

  void add(const Record& record);
  void finish();  ///< after the last record

 private:
  void flush();

  struct Field {
    TimeSpan span{};
    Image<float> x, y;
  };
  Write write_;
  std::optional<Field> field_;    // motion field of the last frame, px/s
  std::optional<Field> pending_;  // written unless a displacement comes instead
};

/// What one file of a sequence holds; the rest is empty.
struct SequenceImages {
  Image<float> irradiance, depth, flow_x, flow_y;
};

/// Files in order of time.
struct FileSequence {
  /// Goes to the next file; false where there is none left.
  std::function<bool(TimeSpan& span, std::filesystem::path& file)> next{};

  /// Reads a file; UserError where it is damaged.
  std::function<void(const std::filesystem::path& file, SequenceImages& images)> read{};

  bool displacements = false;  ///< the flow is a displacement, px, from the span's start to its end; NaN: not known
};

/// The files that a folder's timestamps.txt lists.
FileSequence listed_files(const std::filesystem::path& folder, bool displacements);

/// Sequences of one camera as a recording. All images have the first one's size.
std::unique_ptr<Source> open_sequences(std::vector<FileSequence> sequences, const ReadOptions& options);

}  // namespace esim

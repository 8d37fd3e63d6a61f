#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "esim/recording/format.h"

namespace esim::inline formats {

// Formats of ground truth with one file per frame in a folder: one camera, without poses. Their readers give optical
// flow as OpticalFlowRecord, visible where it is known, and everything else as TruthRecord.

/// `flo`: optical flow from frame to frame, in the format of the Middlebury benchmark.
Format flo_format();

/// `kitti`: 16-bit PNG of KITTI: optical flow from frame to frame in flow/ and depth in depth/.
Format kitti_format();

/// `dsec-flow`: 16-bit PNG of DSEC in forward/, with forward_timestamps.txt.
Format dsec_flow_format();

/// `exr`: OpenEXR files of irradiance, depth and motion field.
Format exr_format();

/// `npy-truth`: one NumPy array per quantity, as in truth.h5.
Format npy_truth_format();

/// Optical flow from each frame of the first camera to the next, px. If a recording has none between two ground-truth
/// frames, the motion field of the first frame times the interval.
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
  std::optional<Field> pending_;  // written unless optical flow arrives instead
};

/// The contents of one file of a sequence; what the file lacks is empty.
struct SequenceImages {
  Image<float> irradiance, depth;
  Image<float> field_x, field_y;  ///< motion field, px/s, or optical flow, px
};

/// Files in order of time.
struct FileSequence {
  /// Goes to the next file; returns false at the end.
  std::function<bool(TimeSpan& span, std::filesystem::path& file)> next{};

  /// Reads a file; throws UserError if it is damaged.
  std::function<void(const std::filesystem::path& file, SequenceImages& images)> read{};

  bool optical_flows = false;  ///< the flow is optical flow, px, from the span's start to its end; NaN: unknown
};

/// The files that a folder's timestamps.txt lists.
FileSequence listed_files(const std::filesystem::path& folder, bool optical_flows);

/// Sequences of one camera as a recording. All images have the first one's size.
std::unique_ptr<Source> open_sequences(std::vector<FileSequence> sequences, const ReadOptions& options);

}  // namespace esim::inline formats

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/geometry/calibration.h"
#include "esim/geometry/se3.h"

/// transforms.json of NeRF, nerfstudio and instant-ngp.
namespace esim::inline geometry {

/// The pose of one image, with esim's axes of the camera: x right, y down, z forward. Those of the file are x right, y
/// up, z backward.
struct TransformsFrame {
  std::string file_path;         ///< empty if the file has none
  std::optional<double> time_s;  ///< `time`, otherwise `timestamp`
  SE3 T_world_camera;
};

/// The frames in the file's order. Stamps are either given for all frames or for none: those that only some of the
/// frames have are left out. Throws UserError, with the file and the frame, for files that are not JSON, missing or
/// malformed matrices and numbers that are not finite.
std::vector<TransformsFrame> read_transforms_frames(const std::filesystem::path& file);

/// The different cameras of the frames as one rig without offsets, in the order of their first frame, named camera1,
/// camera2, ... Intrinsics of a frame override those of the file. Throws UserError as above, and for parameters that
/// are missing, not valid or not supported.
std::vector<CalibratedCamera> read_transforms_calibration(const std::filesystem::path& file);

}  // namespace esim::inline geometry

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "esim/recording/compression.h"
#include "esim/recording/format.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

struct TruthHdf5Options {
  bool depth = true;
  bool motion_field = true;
  Compression compression = Compression::blosc;
  bool objects = false;
  bool optical_flow = false;  ///< false: the dataset is created with the first record of optical flow
};

/// Ground truth of one camera:
///
///   t                   int64 [N]              ns
///   T_world_camera      float64 [N, 7]         tx ty tz (m) qx qy qz qw
///   depth               float32 [N, H, W]      m, planar; +inf: no surface
///   motion_field        float32 [N, 2, H, W]   px/s, x to the right, then y downwards
///   objects             uint16 [N, H, W]       index into the attribute `names`; 0: static scene
///   T_world_objects     float64 [N, K, 7]      poses of the K moving objects in the world, without [0]
///   optical_flow        float32 [N-1, 2, H, W] px, from frame k to frame k + 1; NaN: point has no image
///   optical_flow_valid  uint8 [N-1, H, W]      1: visible in frame k + 1
///
/// Units and conventions are attributes of each dataset. One frame is one chunk, and is in the file when write()
/// returns.
class TruthHdf5Writer final : public Sink {
 public:
  /// Throws UserError if the compression is not available.
  TruthHdf5Writer(std::filesystem::path path, int camera, TruthHdf5Options options = {});
  ~TruthHdf5Writer() override;

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads such files, frame by frame, also older ones, in which motion_field is named flow, and optical_flow
/// displacement. Other, damaged or truncated files are a UserError that names the file.
class TruthHdf5Reader {
 public:
  /// One frame; quantities that the file lacks are empty.
  struct Frame {
    SE3 T_world_camera;
    Image<float> depth, motion_x, motion_y;
    Image<std::uint16_t> object;
    std::vector<SE3> T_world_objects;
  };
  struct OpticalFlow {
    Image<float> x, y;
    Image<std::uint8_t> visible;
  };

  explicit TruthHdf5Reader(std::filesystem::path path);
  ~TruthHdf5Reader();

  std::uint64_t size() const;           ///< number of frames
  std::uint64_t optical_flows() const;  ///< number of fields from a frame to the next
  SensorSize sensor() const;            ///< 0 x 0 if there are no images

  /// Names for the numbers in Frame::object: "static", then objects, then sprites.
  const std::vector<std::string>& names() const;
  std::size_t objects() const;  ///< number of objects with a pose

  TimeNs t(std::uint64_t frame) const;
  void read(std::uint64_t frame, Frame& out) const;
  void read(std::uint64_t frame, OpticalFlow& out) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline formats

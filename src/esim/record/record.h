#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/geometry/camera.h"
#include "esim/geometry/kinematics.h"
#include "esim/geometry/se3.h"

namespace esim {

/// One camera of the recording.
struct CameraInfo {
  std::string name;         ///< unique within the rig: `cam0`, ...
  Camera model;             ///< intrinsics and distortion; 0 where they are not known, as of files by others
  SE3 T_body_camera;        ///< pose of the camera in the body frame
  bool has_frames = false;  ///< a frame camera shares the lens: there may be FrameRecords
};

/// The inertial measurement unit of the recording. Densities are continuous-time.
struct ImuInfo {
  SE3 T_body_imu;  ///< pose of the IMU in the body frame
  double rate_hz = 0;
  double gyroscope_noise_density = 0;      ///< rad/s/sqrt(Hz)
  double gyroscope_random_walk = 0;        ///< rad/s²/sqrt(Hz)
  double accelerometer_noise_density = 0;  ///< m/s²/sqrt(Hz)
  double accelerometer_random_walk = 0;    ///< m/s³/sqrt(Hz)
};

/// What is true of a recording from its start to its end.
struct RecordingInfo {
  std::vector<CameraInfo> cameras;
  TimeNs start = 0;          ///< time of the first sample
  bool start_known = true;   ///< otherwise `start` is merely the time of the first record
  TimeNs end = 0;            ///< time of the last sample, if the recording becomes complete; the start: not known yet
  double truth_rate_hz = 0;  ///< frames of ground truth, or of a video, per second; 0: none
  std::optional<ImuInfo> imu{};

  // Names of what moves, in the order of its numbers: objects of the scene, or layers on the sensor.
  std::vector<std::string> objects{};
  std::vector<std::string> layers{};
};

/// Events of one camera, in order, none at or before what the same camera reported earlier.
struct EventsRecord {
  int camera = 0;  ///< index into RecordingInfo::cameras
  EventSpan events;
};

/// Ground truth of one camera at one instant. The images are borrowed for the duration of the call; those that a
/// recording lacks are empty, the same ones in all of its frames (the irradiance may come and go).
struct TruthRecord {
  int camera = 0;
  TimeNs t = 0;
  SE3 T_world_camera;
  const Image<float>& irradiance;  ///< E, 1.0 = diffuse white
  const Image<float>& depth;       ///< Z, planar, m; +inf where nothing is seen
  const Image<float>& flow_x;      ///< motion field, px/s, positive to the right
  const Image<float>& flow_y;      ///< motion field, px/s, positive downwards

  /// Where wanted: 0, or i + 1 where moving object i is seen.
  const Image<std::uint16_t>* object = nullptr;

  /// Poses of the moving objects; none of layers, which are not in the world.
  std::span<const SE3> T_world_objects{};
};

/// Where what one camera saw at t0 is at t1, the times of consecutive TruthRecords; follows the later one of them. The
/// images are borrowed for the duration of the call.
struct DisplacementRecord {
  int camera = 0;
  TimeNs t0 = 0, t1 = 0;
  const Image<float>& x;               ///< px, positive to the right; NaN where there is no image of it at t1
  const Image<float>& y;               ///< px, positive downwards
  const Image<std::uint8_t>& visible;  ///< 1: seen at t1 as well; 0: hidden then, or outside the image
};

/// What the events of one camera saw; as many points as events.
struct EventPointsRecord {
  int camera = 0;
  EventSpan events;
  std::span<const Eigen::Vector3f> points;  ///< world frame, m; NaN: none
};

/// A frame of a video, as one camera sees it. The image is borrowed for the duration of the call.
struct ImageRecord {
  int camera = 0;
  TimeNs t = 0;
  const Image<float>& irradiance;  ///< E, 1.0 = white
};

/// A frame of a frame camera, reported when its exposure has ended. The image is borrowed for the duration of the call.
struct FrameRecord {
  int camera = 0;
  TimeNs t = 0;                       ///< middle of the exposure; of the middle row, with a rolling shutter
  TimeNs exposure_start = 0;          ///< of the first row
  TimeNs exposure_duration = 0;       ///< of each row
  double gain = 1;                    ///< 1: a full pixel is full scale
  const Image<std::uint16_t>& image;  ///< digital numbers
  int bits = 8;                       ///< of each number
};

/// Where the body and the moving objects are, and how they move.
struct PoseRecord {
  TimeNs t = 0;
  Kinematics body{};
  std::vector<Kinematics> objects{};          ///< as in RecordingInfo::objects
  std::optional<InertialSignals> imu_bias{};  ///< where there is an IMU
};

/// One measurement of the inertial measurement unit, and the biases in it.
struct ImuRecord {
  TimeNs t = 0;
  InertialSignals measured{}, bias{};
};

enum class TriggerKind : std::uint8_t {
  timestamp_reset,
  external_rising,
  external_falling,
  external_pulse,
  generator_rising,
  generator_falling,
  frame_start,
  frame_end,
  exposure_start,
  exposure_end
};

/// A signal that a camera took note of. Frames tell of their exposures themselves.
struct TriggerRecord {
  int camera = 0;
  TimeNs t = 0;
  TriggerKind kind = TriggerKind::external_rising;
};

using Record = std::variant<EventsRecord, TruthRecord, DisplacementRecord, EventPointsRecord, ImageRecord, FrameRecord,
                            PoseRecord, ImuRecord, TriggerRecord>;

/// Where a simulation goes: one class per format, each taking the kinds of record that it can hold.
/// Calls come from one thread: begin, then write in time order per camera, then end.
/// Throws OutputError (what, which file) when something cannot be written.
class Sink {
 public:
  virtual ~Sink() = default;

  virtual void begin(const RecordingInfo& info) = 0;
  virtual void write(const Record& record) = 0;

  /// Makes everything durable. `complete` is false when the simulation was interrupted.
  virtual void end(bool complete) = 0;
};

}  // namespace esim

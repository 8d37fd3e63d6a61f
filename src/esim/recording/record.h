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
#include "esim/events/event_label.h"
#include "esim/geometry/camera.h"
#include "esim/geometry/kinematics.h"
#include "esim/geometry/se3.h"

namespace esim::inline recording {

/// One camera of the recording. Each event sensor of several behind one lens is a camera, too, which has only events;
/// it comes after the cameras with lenses.
struct CameraInfo {
  std::string name;         ///< unique within the rig: `cam0`, ...; of a sensor that shares a lens: `cam0/NAME`
  Camera model;             ///< intrinsics and distortion; 0 if unknown, as in files of other programs
  SE3 T_body_camera;        ///< pose of the camera in the body frame
  bool has_frames = false;  ///< a frame camera shares the lens: FrameRecords are possible
  bool has_labels = false;  ///< all of its EventsRecords have labels
  int lens = -1;            ///< the index of the camera whose lens this event sensor shares; -1: it has its own
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

/// Properties of a whole recording.
struct RecordingInfo {
  std::vector<CameraInfo> cameras;
  TimeNs start = 0;          ///< time of the first sample
  bool start_known = true;   ///< false: `start` is only the time of the first record
  TimeNs end = 0;            ///< time of the last sample, if the recording is completed; equal to the start: unknown
  double truth_rate_hz = 0;  ///< rate of ground-truth frames, or of video frames; 0: none
  std::optional<ImuInfo> imu{};

  // Names of what moves, in the order of their numbers: objects of the scene, or sprites on the sensor.
  std::vector<std::string> objects{};
  std::vector<std::string> sprites{};
};

/// Events of one camera, in order of time, and none at or before earlier events of the same camera.
struct EventsRecord {
  int camera = 0;  ///< index into RecordingInfo::cameras
  EventSpan events;
  LabelSpan labels{};  ///< of these events, in their order; empty without CameraInfo::has_labels

  /// A part of the record.
  EventsRecord part(std::size_t first, std::size_t count) const {
    return {camera, events.subspan(first, count), labels.empty() ? labels : labels.subspan(first, count)};
  }
};

/// Ground truth of one camera at one time. The images are borrowed for the duration of the call. Quantities that a
/// recording lacks are empty, in all of its frames alike (only the irradiance may be missing in some).
struct TruthRecord {
  int camera = 0;
  TimeNs t = 0;
  SE3 T_world_camera;
  const Image<float>& irradiance;  ///< E, 1.0 = diffuse white
  const Image<float>& depth;       ///< Z, planar, m; +inf: no surface
  const Image<float>& motion_x;    ///< motion field, px/s, positive to the right
  const Image<float>& motion_y;    ///< motion field, px/s, positive downwards

  /// If requested: i + 1 for pixels that see moving object i, otherwise 0.
  const Image<std::uint16_t>* object = nullptr;

  /// Poses of the moving objects; empty for sprites, which are not in the world.
  std::span<const SE3> T_world_objects{};
};

/// Optical flow of one camera from t0 to t1, the times of consecutive TruthRecords; follows the later one of them. The
/// images are borrowed for the duration of the call.
struct OpticalFlowRecord {
  int camera = 0;
  TimeNs t0 = 0, t1 = 0;
  const Image<float>& x;               ///< px, positive to the right; NaN: the point has no image at t1
  const Image<float>& y;               ///< px, positive downwards
  const Image<std::uint8_t>& visible;  ///< 1: visible at t1; 0: occluded or outside the image at t1
};

/// Scene points of the events of one camera; as many points as events.
struct EventPointsRecord {
  int camera = 0;
  EventSpan events;
  std::span<const Eigen::Vector3f> points;  ///< world frame, m; NaN: no point
};

/// A frame of an input video, as seen by one camera. The image is borrowed for the duration of the call.
struct ImageRecord {
  int camera = 0;
  TimeNs t = 0;
  const Image<float>& irradiance;  ///< E, 1.0 = white
};

/// A frame of a frame camera, reported at the end of its exposure. The image is borrowed for the duration of the call.
struct FrameRecord {
  int camera = 0;
  TimeNs t = 0;                       ///< middle of the exposure; with a rolling shutter, of the middle row
  TimeNs exposure_start = 0;          ///< of the first row
  TimeNs exposure_duration = 0;       ///< of each row
  double gain = 1;                    ///< 1: a full pixel gives the largest number
  const Image<std::uint16_t>& image;  ///< digital numbers
  int bits = 8;                       ///< bits per number
};

/// Poses and motion of the body and of the moving objects.
struct PoseRecord {
  TimeNs t = 0;
  Kinematics body{};
  std::vector<Kinematics> objects{};          ///< in the order of RecordingInfo::objects
  std::optional<InertialSignals> imu_bias{};  ///< if there is an IMU
};

/// One measurement of the inertial measurement unit, and its biases.
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

/// A trigger signal recorded by a camera. Exposures of frames are in FrameRecord.
struct TriggerRecord {
  int camera = 0;
  TimeNs t = 0;
  TriggerKind kind = TriggerKind::external_rising;
};

using Record = std::variant<EventsRecord, TruthRecord, OpticalFlowRecord, EventPointsRecord, ImageRecord, FrameRecord,
                            PoseRecord, ImuRecord, TriggerRecord>;

/// The output of a simulation: one class per format, each taking the kinds of record that it can hold.
/// Calls come from one thread: begin, then write in time order per camera, then end.
/// Throws OutputError (what, which file) if something cannot be written.
class Sink {
 public:
  virtual ~Sink() = default;

  virtual void begin(const RecordingInfo& info) = 0;
  virtual void write(const Record& record) = 0;

  /// Makes everything durable. `complete` is false if the simulation was interrupted.
  virtual void end(bool complete) = 0;
};

}  // namespace esim::inline recording

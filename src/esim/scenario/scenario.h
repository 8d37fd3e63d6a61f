#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/colour/colour.h"
#include "esim/core/inputs/used_files.h"
#include "esim/event_camera/event_camera.h"
#include "esim/frame_camera/options.h"
#include "esim/geometry/camera.h"
#include "esim/imu/options.h"
#include "esim/sampling/options.h"
#include "esim/scenario/light_options.h"
#include "esim/scenario/pose_options.h"
#include "esim/scenario/renderer_options.h"
#include "esim/scenario/trajectory_options.h"

namespace esim::inline scenario {

// --- event sensors -----------------------------------------------------------------------------------------------

/// One event sensor behind the lens of a camera.
struct SensorOptions : EventCameraOptions {
  std::string name{};                   ///< of the folder of its files; empty: that of its camera
  std::optional<std::uint64_t> seed{};  ///< of its random numbers; unset: the scenario's

  /// An option that a grid or a distribution has set.
  struct Varied {
    std::string key;    ///< dotted
    std::string value;  ///< as YAML
  };
  std::vector<Varied> varied{};  ///< for reports
};

// --- cameras -----------------------------------------------------------------------------------------------------

/// Distortions as written in a scenario. An empty struct stands for no distortion.
struct NoDistortionOptions {
  static constexpr const char* kType = "none";
};
struct RadialTangentialOptions : RadialTangential {
  static constexpr const char* kType = "radial-tangential";
};
struct EquidistantOptions : Equidistant {
  static constexpr const char* kType = "equidistant";
};
struct FovOptions : Fov {
  static constexpr const char* kType = "fov";
};
using DistortionOptions = std::variant<NoDistortionOptions, RadialTangentialOptions, EquidistantOptions, FovOptions>;

/// One camera of the rig. If `calibration` is given, the geometry comes from that file.
struct CameraOptions {
  std::string name;
  std::filesystem::path calibration;
  int width = 346, height = 260;
  std::optional<double> horizontal_fov_deg;
  std::optional<double> fx, fy, cx, cy;
  DistortionOptions distortion;
  double fill_factor = 1;
  double psf_px = 0;
  PoseOptions T_body_camera;
  ColourFilters colour = ColourFilters::none;
  SamplingOptions sampling;
  bool events = true;
  SensorOptions event_camera;                      ///< the only event sensor, unless event_cameras has any
  std::vector<SensorOptions> event_cameras{};      ///< several; each has a name, unique within the camera
  std::optional<FrameCameraOptions> frame_camera;  ///< unset: no frame camera

  /// The event sensors.
  std::span<const SensorOptions> sensors() const {
    if (!events) return {};
    return event_cameras.empty() ? std::span(&event_camera, 1) : std::span(event_cameras);
  }
  /// The first of them; default values for a camera without any.
  const SensorOptions& first_sensor() const { return event_cameras.empty() ? event_camera : event_cameras.front(); }
};

// --- the inertial measurement unit --------------------------------------------------------------------------------

/// The IMU of the rig. If `calibration` is given, its rate and noise come from that file.
struct RigImuOptions : ImuOptions {
  std::filesystem::path calibration;
  PoseOptions T_body_imu;
};

// --- what is written -----------------------------------------------------------------------------------------------

struct TruthOptions {
  double rate_hz = 30;
  bool images = true;
  bool depth = true;
  bool motion_field = true;
  bool optical_flow = false;
  bool objects = false;
  bool event_points = false;
  double pose_rate_hz = 200;
};

enum class EventTimeUnit { us, ns };
enum class EventCompression { blosc, gzip, none };

/// Whether the samples of event sensors are kept.
enum class KeptSamples { none, rounded, exact };

struct OutputOptions {
  EventTimeUnit time_unit = EventTimeUnit::us;
  EventCompression compression = EventCompression::blosc;
  std::vector<std::string> formats{};
  bool preview = true;
  KeptSamples samples = KeptSamples::none;
  bool checkpoints = true;
};

// --- the scenario --------------------------------------------------------------------------------------------------

/// All options of a simulation: the scene, the motion of the rig, its cameras, and the files to write.
struct Scenario {
  std::uint64_t seed = 0;
  double start_s = 0.0;              ///< after the trajectory's start
  std::optional<double> duration_s;  ///< unset: until the trajectory's end
  RendererOptions renderer;
  LightOptions light;
  TrajectoryOptions trajectory;
  std::vector<CameraOptions> cameras;
  std::optional<RigImuOptions> imu;
  TruthOptions truth;
  OutputOptions output;

  /// What users should know about the text from which the scenario was read: options that have other names now.
  std::vector<std::string> notices{};

  /// The files from which it was read: its own, and those that are replaced by their contents here, such as
  /// calibrations.
  std::vector<UsedFile> files{};
};

}  // namespace esim::inline scenario

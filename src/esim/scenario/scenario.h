#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/colour.h"
#include "esim/event_camera/event_camera.h"
#include "esim/frame_camera/options.h"
#include "esim/geometry/camera.h"
#include "esim/imu/options.h"
#include "esim/sampling/options.h"
#include "esim/scenario/pose_options.h"
#include "esim/scene/engine_images.h"
#include "esim/scene/sprite.h"

namespace esim::inline scenario {

// --- trajectories of the body and of objects -----------------------------------------------------------------------

struct FileTrajectoryOptions {
  static constexpr const char* kType = "file";
  std::filesystem::path path;
  double time_scale = 1.0;
  int order = 5;
  double knot_interval_s = 0.0;
  double smoothing_time_s = 0.0;
};

struct RandomTrajectoryOptions {
  static constexpr const char* kType = "random";
  Eigen::Vector3d position_amplitude_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_amplitude_deg = Eigen::Vector3d::Zero();
  double knot_interval_s = 0.25;
  PoseOptions center;
  int order = 5;
};

struct StaticTrajectoryOptions {
  static constexpr const char* kType = "static";
  PoseOptions pose;
};

/// The motion of a camera in the renderer's scene file.
struct SceneTrajectoryOptions {
  static constexpr const char* kType = "scene";
  std::string camera;
};

/// A pose that the body passes through, and when or how.
struct WaypointPointOptions : PoseOptions {
  std::optional<Eigen::Vector3d> up;
  std::optional<double> t, speed, pause_s;
};

/// If `file` is given, the points come from there.
struct WaypointTrajectoryOptions {
  static constexpr const char* kType = "waypoints";
  std::filesystem::path file;
  std::vector<WaypointPointOptions> points;
  double speed = 1.0;
  double turn_deg_per_s = 45.0;
  double ramp_s = 0.5;
  bool rest = true;
  bool closed = false;

  /// The file that the points were read from, for messages; empty if the scenario lists them.
  std::filesystem::path points_file;
};

using TrajectoryOptions = std::variant<FileTrajectoryOptions, RandomTrajectoryOptions, StaticTrajectoryOptions,
                                       SceneTrajectoryOptions, WaypointTrajectoryOptions>;

// --- renderers ---------------------------------------------------------------------------------------------------

/// A moving object of the scene.
struct ObjectOptions {
  std::string name;
  std::filesystem::path scene;
  double scale = 1.0;
  TrajectoryOptions trajectory;
};

struct SunOptions {
  Eigen::Vector3d direction = {0, 0, -1};
  double strength = 1.0;
};

struct PointLightOptions {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double strength = 1.0;
};

/// Surfaces show their base colour, independent of lights.
struct UnlitOptions {
  static constexpr const char* kType = "unlit";
};

/// Diffuse surfaces under lights.
struct LambertOptions {
  static constexpr const char* kType = "lambert";
  double ambient = 0.3;
  std::vector<SunOptions> suns;
  std::vector<PointLightOptions> points;
  bool shadows = false;
};

using LightingOptions = std::variant<UnlitOptions, LambertOptions>;

/// The renderer of triangles.
enum class MeshEngine { raycast, gl, automatic };

/// Triangles.
struct MeshRendererOptions {
  static constexpr const char* kType = "mesh";
  MeshEngine engine = MeshEngine::raycast;
  std::optional<int> gl_device;
  std::filesystem::path scene;
  double time_scale = 1.0;
  std::vector<ObjectOptions> objects;
  LightingOptions lighting;
  int samples_per_pixel = 1;
  double background = 0.2;
};

/// An equirectangular image at infinity.
struct PanoramaRendererOptions {
  static constexpr const char* kType = "panorama";
  std::filesystem::path image;
  Eigen::Vector4d orientation = {0, 0, 0, 1};
  int median_px = 0;
  double gaussian_px = 0;
};

/// A textured rectangle.
struct PlaneRendererOptions {
  static constexpr const char* kType = "plane";
  std::filesystem::path image;
  double width_m = 1.0;
  PoseOptions pose;
  bool endless = false;
  int median_px = 0;
  double gaussian_px = 0;
  double background = 0.2;
};

/// A sprite: an image that moves over the sensor.
struct SpriteOptions {
  std::filesystem::path image;
  SpriteUnits units = SpriteUnits::pixel;
  SpriteBeyond beyond = SpriteBeyond::nothing;
  int median_px = 0;
  double gaussian_px = 0;
  Eigen::Vector2d pivot{0.5, 0.5};
  SpriteInterpolation interpolation = SpriteInterpolation::spline;
  std::vector<SpritePose> poses{SpritePose{}};  // at rest in the middle
};

/// Sprites on the sensor. If `scene` is given, they come from that file.
struct SpritesRendererOptions {
  static constexpr const char* kType = "sprites";
  std::filesystem::path scene;
  std::vector<std::filesystem::path> search_path;
  std::vector<SpriteOptions> sprites;
  double background = 0.2;
};

/// An object in another program's scene that esim moves.
struct EngineObjectOptions {
  std::string name;
  TrajectoryOptions trajectory;
};

/// A program that speaks UnrealCV's protocol.
struct UnrealcvRendererOptions {
  static constexpr const char* kType = "unrealcv";
  std::string host = "127.0.0.1";
  int port = 9000;
  double timeout_s = 10;
  int camera = 0;
  std::vector<EngineObjectOptions> objects;
  EngineLight light = EngineLight::automatic;
  double exposure = 1.0;
  EngineDepth depth = EngineDepth::automatic;
  EngineMask object_mask = EngineMask::automatic;
  bool pipelined = true;
  int lag_frames = 0;
};

enum class BlenderEngine { cycles, eevee };

/// Blender, which esim starts or which runs already.
struct BlenderRendererOptions {
  static constexpr const char* kType = "blender";
  std::filesystem::path scene;
  std::string address;
  BlenderEngine engine = BlenderEngine::cycles;
  int samples = 16;
  int noise_seed = 0;
  int threads = 0;
  std::vector<EngineObjectOptions> objects;
  double exposure = 1.0;
  double timeout_s = 600;
};

using RendererOptions = std::variant<MeshRendererOptions, PanoramaRendererOptions, PlaneRendererOptions,
                                     SpritesRendererOptions, UnrealcvRendererOptions, BlenderRendererOptions>;

/// The moving objects in the scene of another program that renders; null if esim renders.
inline const std::vector<EngineObjectOptions>* engine_objects(const RendererOptions& renderer) {
  if (const auto* const unrealcv = std::get_if<UnrealcvRendererOptions>(&renderer)) return &unrealcv->objects;
  if (const auto* const blender = std::get_if<BlenderRendererOptions>(&renderer)) return &blender->objects;
  return nullptr;
}

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
  PoseOptions T_body_camera;
  ColourFilters colour = ColourFilters::none;
  SamplingOptions sampling;
  bool events = true;
  EventCameraOptions event_camera;
  std::optional<FrameCameraOptions> frame_camera;  ///< unset: no frame camera
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

struct OutputOptions {
  EventTimeUnit time_unit = EventTimeUnit::us;
  EventCompression compression = EventCompression::blosc;
  std::vector<std::string> formats{};
  bool preview = true;
};

// --- the scenario --------------------------------------------------------------------------------------------------

/// All options of a simulation: the scene, the motion of the rig, its cameras, and the files to write.
struct Scenario {
  std::uint64_t seed = 0;
  double start_s = 0.0;              ///< after the trajectory's start
  std::optional<double> duration_s;  ///< unset: until the trajectory's end
  RendererOptions renderer;
  TrajectoryOptions trajectory;
  std::vector<CameraOptions> cameras;
  std::optional<RigImuOptions> imu;
  TruthOptions truth;
  OutputOptions output;

  /// What users should know about the text from which the scenario was read: options that have other names now.
  std::vector<std::string> notices{};
};

}  // namespace esim::inline scenario

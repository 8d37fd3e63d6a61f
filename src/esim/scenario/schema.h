#pragma once

#include "esim/scenario/scenario.h"

/// The schema: every option of a scenario once, with unit, range and help (see core/describe.h). Options that have a
/// file of their own (renderers, trajectories, sampling, the sensors) are described there.
namespace esim::inline scenario {

template <class Visitor>
void describe(Visitor&, NoDistortionOptions&) {}

template <class Visitor>
void describe(Visitor& visit, RadialTangentialOptions& o) {
  visit("k1", o.k1, About{"radial, r^2"});
  visit("k2", o.k2, About{"radial, r^4"});
  visit("p1", o.p1, About{"tangential distortion"});
  visit("p2", o.p2, About{"tangential distortion"});
  visit("k3", o.k3, About{"radial, r^6"});
}

template <class Visitor>
void describe(Visitor& visit, EquidistantOptions& o) {
  visit("k1", o.k1, About{"theta^2"});
  visit("k2", o.k2, About{"theta^4"});
  visit("k3", o.k3, About{"theta^6"});
  visit("k4", o.k4, About{"theta^8"});
}

template <class Visitor>
void describe(Visitor& visit, FovOptions& o) {
  visit("w", o.w, About{"field of view of the distortion model", "rad", 0, 3.1, true});
}

template <class Visitor>
void describe(Visitor& visit, SensorOptions& o) {
  visit("name", o.name,
        About{"name of the sensor's folder in that of its camera (default: the only sensor has none; others are "
              "sensor0, sensor1, ...)"});
  visit("seed", o.seed, About{"seed of the sensor's random numbers (default: that of the scenario)"});
  describe(visit, static_cast<EventCameraOptions&>(o));
}

/// The size and the lens of a camera.
template <class Visitor>
void describe_geometry(Visitor& visit, CameraOptions& o) {
  visit("width", o.width, About{"columns", "px", 1, 16384});
  visit("height", o.height, About{"rows", "px", 1, 16384});
  visit("horizontal_fov_deg", o.horizontal_fov_deg,
        About{"horizontal field of view, if fx is not given (default: that of the scene's camera for a trajectory of "
              "type scene, 75 otherwise)",
              "deg", 0.1, 170});
  visit("fx", o.fx, About{"focal length, horizontal", "px", 0, 1e6, true});
  visit("fy", o.fy, About{"focal length, vertical (default: fx)", "px", 0, 1e6, true});
  visit("cx", o.cx, About{"principal point, column (default: the middle)", "px", -1e6, 1e6});
  visit("cy", o.cy, About{"principal point, row (default: the middle)", "px", -1e6, 1e6});
  visit("distortion", o.distortion, About{"distortion of the lens"});
}

template <class Visitor>
void describe(Visitor& visit, CameraOptions& o) {
  visit("name", o.name, About{"name, unique within the rig (default: cam0, cam1, ...)"});
  visit(
      "calibration", o.calibration,
      About{
          "calibration: a Kalibr camchain, a rig file of the original ESIM, a COLMAP model (folder or cameras file) or "
          "a transforms.json; gives size, intrinsics, distortion and pose of one camera or several"});
  describe_geometry(visit, o);
  visit("fill_factor", o.fill_factor,
        About{"the part of a pixel's area that sees light, a square in its middle", "", 0.01, 1});
  visit("psf_px", o.psf_px,
        About{"blur of the lens: standard deviation of its Gaussian point spread function; 0: none", "px", 0, 10});
  visit("T_body_camera", o.T_body_camera, About{"pose of the camera (x right, y down, z forward) in the body"});
  visit("colour", o.colour,
        About{"colour filters of the pixels; rggb: 2 x 2 pattern with red at even columns and rows; none: pixels see "
              "luminance"});
  visit("sampling", o.sampling,
        About{"when esim renders the scene (default: adaptive; flow for renderers of complete images, such as OpenGL; "
              "keyframes if another program renders)"});
  visit("events", o.events, About{"whether the camera has an event sensor; false: it is a standard camera"});
  if (o.event_cameras.empty())
    visit("event_camera", o.event_camera,
          About{"the event sensor; an option may be {values: [...]} or a distribution such as {uniform: [LOW, HIGH]}, "
                "and count a number of sensors: then there are several"});
  visit("event_cameras", o.event_cameras,
        About{"several event sensors that see the same: a list of maps like event_camera, which gives their defaults"});
  visit("frame_camera", o.frame_camera, About{"a standard camera at the same pose (default: none)"});
}

template <class Visitor>
void describe(Visitor& visit, RigImuOptions& o) {
  visit("calibration", o.calibration, About{"Kalibr's imu.yaml: gives rate_hz, noise densities and random walks"});
  visit("T_body_imu", o.T_body_imu, About{"pose of the IMU in the body"});
  describe(visit, static_cast<ImuOptions&>(o));
}

template <class Visitor>
void describe(Visitor& visit, TruthOptions& o) {
  visit("rate_hz", o.rate_hz, About{"ground-truth frames per second; 0: no frames", "Hz", 0, 1e6});
  visit("images", o.images, About{"write images/, 8-bit sRGB"});
  visit("depth", o.depth, About{"write depth to truth.h5"});
  visit("motion_field", o.motion_field, About{"write the motion field to truth.h5"});
  visit("optical_flow", o.optical_flow,
        About{"write optical flow (px) from each frame to the next to truth.h5, with occlusions"});
  visit("objects", o.objects,
        About{"write the index of the moving object, or of the sprite, that each pixel sees to truth.h5"});
  visit("event_points", o.event_points, About{"write the scene point of each event to event_points.ply"});
  visit("pose_rate_hz", o.pose_rate_hz,
        About{"poses per second in poses.txt and states.csv; 0: no poses", "Hz", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, OutputOptions& o) {
  visit("time_unit", o.time_unit, About{"unit of the times in events.h5"});
  visit("compression", o.compression, About{"compression of events.h5 and truth.h5"});
  visit("formats", o.formats,
        About{"additional formats to write, by their names in esim convert --list, such as text, rosbag"});
  visit("preview", o.preview, About{"write preview.mp4 and preview.png"});
  visit(
      "samples", o.samples,
      About{"keep what the event sensors saw in samples.esim, for esim resense; true: with an error of the brightness "
            "up to 0.0005; exact: without, and larger"});
  visit(
      "checkpoints", o.checkpoints,
      About{"save the state of the simulation every few seconds, so that esim simulate --resume can continue it after "
            "it has ended early"});
}

/// All options of a scenario except its cameras, which have two spellings (see read_scenario).
template <class Visitor>
void describe(Visitor& visit, Scenario& o) {
  visit("seed", o.seed, About{"seed of all random numbers"});
  visit("start_s", o.start_s, About{"start of the simulation, after the trajectory's start", "s", 0, 1e9});
  visit("duration_s", o.duration_s,
        About{"duration of the simulation (default: until the trajectory, or the sprites' poses, end)", "s", 0, 1e9,
              true});
  visit("renderer", o.renderer, About{"what the cameras see"});
  visit("light", o.light, About{"the light of the scene: its flicker, and the unit of irradiance"});
  visit("trajectory", o.trajectory, About{"how the body moves"});
  visit("imu", o.imu, About{"inertial measurement unit; {} gives one with default values (default: none)"});
  visit("truth", o.truth, About{"ground truth"});
  visit("output", o.output, About{"files that esim writes"});
}

}  // namespace esim::inline scenario

namespace esim {

template <>
inline constexpr std::array<const char*, 2> kEnumNames<ColourFilters>{"none", "rggb"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<EventTimeUnit>{"us", "ns"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<KeptSamples>{"false", "true", "exact"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<EventCompression>{"blosc", "gzip", "none"};

}  // namespace esim

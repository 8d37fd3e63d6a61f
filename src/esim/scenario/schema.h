#pragma once

#include "esim/scenario/scenario.h"

/// The schema: every option of a scenario once, with unit, range and help (see core/describe.h). Options of modules
/// that stand on their own, like the event camera's, are described beside them.
namespace esim {

template <class Visitor>
void describe(Visitor& visit, FileTrajectoryOptions& o) {
  visit("path", o.path, About{"poses: TUM text (s) or CSV (ns), told apart by content"});
  visit("time_scale", o.time_scale, About{"stretches time: 2 takes twice as long", "", 0, 1e6, true});
  visit("order", o.order, About{"of the fitted spline: 4 (cubic) to 6", "", 4, 6});
  visit("knot_interval_s", o.knot_interval_s,
        About{"time between the spline's control points; 0: from the data", "s", 0, 1e6});
  visit("smoothing_time_s", o.smoothing_time_s,
        About{"motion faster than this is smoothed away; 0: none", "s", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, RandomTrajectoryOptions& o) {
  visit("position_amplitude_m", o.position_amplitude_m,
        About{"greatest displacement along the centre's axes x y z", "m", 0, 1e6});
  visit("rotation_amplitude_deg", o.rotation_amplitude_deg,
        About{"greatest rotation about its axes x y z (for a camera: pitch, yaw, roll)", "deg", 0, 36000});
  visit("knot_interval_s", o.knot_interval_s, About{"time between random poses: smaller is faster", "s", 0, 1e6, true});
  visit("center", o.center,
        About{"pose that it moves about; a body looks along world x where no orientation is given"});
  visit("order", o.order, About{"of the spline: 4 (cubic) to 6", "", 4, 6});
}

template <class Visitor>
void describe(Visitor& visit, StaticTrajectoryOptions& o) {
  visit("pose", o.pose, About{"where it is; a body looks along world x where no orientation is given"});
}

template <class Visitor>
void describe(Visitor& visit, SceneTrajectoryOptions& o) {
  visit("camera", o.camera,
        About{"of the renderer's scene file, whose motion and field of view are used (default: its only one)"});
}

template <class Visitor>
void describe(Visitor& visit, WaypointPointOptions& o) {
  visit("position", o.position, About{"of the body", "m", -1e6, 1e6});
  visit("quaternion", o.quaternion, About{"orientation of the body, Hamilton, x y z w"});
  visit("look_at", o.look_at,
        About{"instead of a quaternion: point on the optical axis of the first camera (for an object: on its z axis)",
              "m", -1e6, 1e6});
  visit("up", o.up, About{"with look_at: what is upwards in the image (default: world z)"});
  visit("t", o.t, About{"when it is reached; of all points or of none", "s", -1e8, 1e8});
  visit("speed", o.speed,
        About{"on the way to the next point, without times (default: the trajectory's)", "m/s", 0, 1e6, true});
  visit("pause_s", o.pause_s, About{"for which the body stands still there (default: 0)", "s", 0, 1e8});
}

template <class Visitor>
void describe(Visitor& visit, WaypointTrajectoryOptions& o) {
  visit("file", o.file, About{"instead of points: a YAML file that has them, as esim waypoints writes it"});
  visit("points", o.points, About{"two or more, passed through in this order: a list of maps of"});
  visit("speed", o.speed, About{"along the path, where the points have no times", "m/s", 0, 1e6, true});
  visit("turn_deg_per_s", o.turn_deg_per_s,
        About{"rate of turning on the spot, and the highest mean rate between two points, where they have no times",
              "deg/s", 0, 1e6, true});
  visit("ramp_s", o.ramp_s,
        About{"time to gather speed after standing still, and to lose it before", "s", 0, 1e6, true});
  visit("rest", o.rest, About{"the body stands still at the start and at the end"});
  visit("closed", o.closed, About{"it returns to the first point; without times only"});
}

template <class Visitor>
void describe(Visitor& visit, ObjectOptions& o) {
  visit("name", o.name, About{"in messages and ground truth; unique (default: object0, object1, ...)"});
  visit("scene", o.scene, About{"scene file, in the object's own coordinates"});
  visit("scale", o.scale, About{"factor that makes its coordinates metres", "", 0, 1e6, true});
  visit("trajectory", o.trajectory, About{"how it moves: pose of its coordinates in the world"});
}

template <class Visitor>
void describe(Visitor& visit, SunOptions& o) {
  visit("direction", o.direction, About{"in which it shines, world frame"});
  visit("strength", o.strength, About{"irradiance of a white surface that faces it", "", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, PointLightOptions& o) {
  visit("position", o.position, About{"world frame", "m"});
  visit("strength", o.strength, About{"irradiance of a white surface that faces it from 1 m away", "", 0, 1e9});
}

template <class Visitor>
void describe(Visitor&, UnlitOptions&) {}

template <class Visitor>
void describe(Visitor& visit, LambertOptions& o) {
  visit("ambient", o.ambient, About{"irradiance of a white surface that no light reaches", "", 0, 1e6});
  visit("suns", o.suns, About{"parallel light: a list of maps of"});
  visit("points", o.points, About{"light from points, falling with the squared distance: a list of maps of"});
  visit("shadows", o.shadows, About{"light stops at the first surface"});
}

template <class Visitor>
void describe(Visitor& visit, MeshRendererOptions& o) {
  visit("engine", o.engine,
        About{"raycast (Embree), gl (OpenGL), or auto: gl where there is a graphics card, raycast otherwise"});
  visit("gl_device", o.gl_device,
        About{"which graphics device, from 0 (default: the first that is no software)", "", 0, 31});
  visit("scene", o.scene,
        About{"scene file: GLB, glTF, Blender's .blend, OBJ, PLY, STL, FBX, Collada; what is animated in it moves"});
  visit("time_scale", o.time_scale,
        About{"stretches the scene file's animation: 2 takes twice as long", "", 0, 1e6, true});
  visit("objects", o.objects, About{"things that move through it: a list of maps of"});
  visit("lighting", o.lighting, About{"unlit: surfaces are as bright as their texture, as baked scenes want it"});
  visit("samples_per_pixel", o.samples_per_pixel,
        About{"rays where an edge crosses a pixel, 1, 16 or 64: more smooth the edges of objects and shadows", "", 1,
              64});
  visit("background", o.background, About{"irradiance where nothing is seen", "", 0, 1e6});
}

/// The filters of an image (scene/image_file.h, Softening).
template <class Visitor, class Options>
void describe_softening(Visitor& visit, Options& o) {
  visit("median_px", o.median_px, About{"side of a median filter over the image, odd; 0: none", "px", 0, 255});
  visit("gaussian_px", o.gaussian_px, About{"standard deviation of a blur of the image; 0: none", "px", 0, 100});
}

template <class Visitor>
void describe(Visitor& visit, PanoramaRendererOptions& o) {
  visit("image", o.image,
        About{"equirectangular image: its centre is seen along world x, its upper edge at the zenith (z)"});
  visit("orientation", o.orientation, About{"of the panorama in the world, quaternion x y z w"});
  describe_softening(visit, o);
}

template <class Visitor>
void describe(Visitor& visit, PlaneRendererOptions& o) {
  visit("image", o.image, About{"image of the poster"});
  visit("width_m", o.width_m, About{"width of the poster; the height follows from the image", "m", 0, 1e6, true});
  visit("pose", o.pose, About{"of the poster: origin at its centre, x right and y down the image, z into the wall"});
  visit("endless", o.endless, About{"repeat the image over the whole plane"});
  describe_softening(visit, o);
  visit("background", o.background, About{"irradiance beside the poster", "", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, LayerKeyframe& o) {
  visit("t_s", o.t_s,
        About{"when, on the trajectory's clock; those of other trajectories than files start at 0", "s", -1e8, 1e8});
  visit("position", o.position,
        About{"of the layer's pivot from the sensor's centre, to the right and downwards, in units", "", -1e6, 1e6});
  visit("rotation_deg", o.rotation_deg, About{"about the layer's pivot, clockwise", "deg", -1e9, 1e9});
  visit("scale", o.scale, About{"of width and height; negative ones mirror", "", -1e6, 1e6});
  visit("shear", o.shear,
        About{"shift to the right over distance downwards, after the scale and before the rotation", "", -1e6, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, LayerOptions& o) {
  visit("image", o.image, About{"image, with alpha or opaque"});
  visit("units", o.units,
        About{"pixel: scale 1 makes a texel a pixel; sensor: it fills the sensor, whose width and height are 1"});
  visit("beyond", o.beyond, About{"what is seen beyond the image's edges"});
  describe_softening(visit, o);
  visit("pivot", o.pivot,
        About{"point of the image that keyframes give the place of: [0, 0] its upper left corner, [1, 1] its lower "
              "right one",
              "", -1e3, 1e3});
  visit("interpolation", o.interpolation, About{"motion between keyframes: natural cubic splines, or constant rates"});
  visit("keyframes", o.keyframes,
        About{"in order of time; the layer rests before the first and after the last (default: in the middle)"});
}

template <class Visitor>
void describe(Visitor& visit, SpritesRendererOptions& o) {
  visit("scene", o.scene,
        About{"the original ESIM's .scene file, instead of layers: gives them, and where the scenario "
              "does not, the duration and the camera's size"});
  visit("search_path", o.search_path, About{"folders in which the scene file's images are looked for"});
  visit("layers", o.layers, About{"images on the sensor, the nearest first"});
  visit("background", o.background, About{"irradiance where no layer is", "", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, EngineObjectOptions& o) {
  visit("name", o.name, About{"that the program knows it by"});
  visit("trajectory", o.trajectory, About{"how it moves: pose of its frame (x forward, y left, z up) in the world"});
}

template <class Visitor>
void describe(Visitor& visit, UnrealcvRendererOptions& o) {
  visit("host", o.host, About{"where the program runs (default: 127.0.0.1)"});
  visit("port", o.port, About{"on which it listens", "", 1, 65535});
  visit("timeout_s", o.timeout_s,
        About{"longest wait for the connection, for each answer, and for a program that has gone away", "s", 0, 86400,
              true});
  visit("camera", o.camera, About{"id of the program's camera that is moved, for all cameras of the rig", "", 0, 1e6});
  visit("objects", o.objects, About{"things of its scene that are moved: a list of maps of"});
  visit("light", o.light, About{"how images are asked for; auto: npy where it is offered, png otherwise"});
  visit("exposure", o.exposure, About{"factor from its light to irradiance", "", 0, 1e6, true});
  visit("depth", o.depth,
        About{"which depth is asked for, and what it is; auto: plane_depth where it is offered, otherwise what the "
              "version suggests"});
  visit("object_mask", o.object_mask,
        About{"how is asked which object a pixel sees; none: the motion field takes all for standing still"});
  visit("pipelined", o.pipelined, About{"send the commands of a frame together, not each after the last one's answer"});
  visit("lag_frames", o.lag_frames,
        About{"images to throw away after each move, for programs that show it late", "", 0, 100});
}

template <class Visitor>
void describe(Visitor& visit, BlenderRendererOptions& o) {
  visit("scene", o.scene, About{"what Blender opens: .blend, or .glb, .obj, .ply, .fbx, .dae"});
  visit(
      "address", o.address,
      About{"HOST:PORT of a Blender that serves already, instead of one that is started; scene, engine, noise_seed and "
            "threads are its own"});
  visit("engine", o.engine, About{"cycles: path tracing; eevee: Blender's rasteriser"});
  visit("samples", o.samples,
        About{"light paths per pixel of the sensor; the pixels of denser keyframes share them", "", 1, 65536});
  visit("noise_seed", o.noise_seed, About{"of the path tracer", "", 0, 2147483647});
  visit("threads", o.threads, About{"that Blender renders with; 0: all processors", "", 0, 1024});
  visit("objects", o.objects, About{"things of the scene that are moved: a list of maps of"});
  visit("exposure", o.exposure, About{"factor from Blender's linear light to irradiance", "", 0, 1e6, true});
  visit("timeout_s", o.timeout_s,
        About{"longest wait for Blender to open the scene, and for each image", "s", 0, 86400, true});
}

template <class Visitor>
void describe(Visitor&, NoDistortionOptions&) {}

template <class Visitor>
void describe(Visitor& visit, RadialTangentialOptions& o) {
  visit("k1", o.k1, About{"radial, r^2"});
  visit("k2", o.k2, About{"radial, r^4"});
  visit("p1", o.p1, About{"tangential"});
  visit("p2", o.p2, About{"tangential"});
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
void describe(Visitor& visit, CameraOptions& o) {
  visit("name", o.name, About{"unique within the rig (default: cam0, cam1, ...)"});
  visit("calibration", o.calibration,
        About{"rig file, Kalibr camchain or the original ESIM's: gives size, intrinsics, distortion and pose; a file "
              "of several cameras makes as many"});
  visit("width", o.width, About{"columns", "px", 1, 16384});
  visit("height", o.height, About{"rows", "px", 1, 16384});
  visit("horizontal_fov_deg", o.horizontal_fov_deg,
        About{"field of view between the image's sides, where fx is not given (default: that of the scene's camera "
              "for a trajectory of type scene, 75 otherwise)",
              "deg", 0.1, 170});
  visit("fx", o.fx, About{"focal length, horizontal", "px", 0, 1e6, true});
  visit("fy", o.fy, About{"focal length, vertical (default: fx)", "px", 0, 1e6, true});
  visit("cx", o.cx, About{"principal point, column (default: the middle)", "px", -1e6, 1e6});
  visit("cy", o.cy, About{"principal point, row (default: the middle)", "px", -1e6, 1e6});
  visit("distortion", o.distortion, About{"of the lens"});
  visit("T_body_camera", o.T_body_camera, About{"pose of the camera (x right, y down, z forward) in the body"});
  visit("colour", o.colour,
        About{"filters on the pixels; rggb: red at even columns and rows, green, green, blue; none: luminance"});
  visit("sampling", o.sampling,
        About{"when the scene is evaluated (default: adaptive; flow where whole images are rendered, as by OpenGL; "
              "keyframes where another program renders)"});
  visit("events", o.events, About{"whether the camera has an event sensor; without, it is a standard camera"});
  visit("event_camera", o.event_camera, About{"the event sensor"});
  visit("frame_camera", o.frame_camera, About{"a standard camera in the same place (default: none)"});
}

template <class Visitor>
void describe(Visitor& visit, RigImuOptions& o) {
  visit("calibration", o.calibration, About{"Kalibr's imu.yaml: gives rate_hz, noise densities and random walks"});
  visit("T_body_imu", o.T_body_imu, About{"pose of the IMU in the body"});
  describe(visit, static_cast<ImuOptions&>(o));
}

template <class Visitor>
void describe(Visitor& visit, TruthOptions& o) {
  visit("rate_hz", o.rate_hz, About{"ground-truth frames per second; 0: none", "Hz", 0, 1e6});
  visit("images", o.images, About{"write images/, 8-bit sRGB"});
  visit("depth", o.depth, About{"write depth to truth.h5"});
  visit("flow", o.flow, About{"write the motion field to truth.h5"});
  visit("displacement", o.displacement,
        About{"write optical flow from each frame to the next to truth.h5, with what is hidden"});
  visit("objects", o.objects, About{"write which moving object, or layer, each pixel sees to truth.h5"});
  visit("event_points", o.event_points, About{"write the point of the scene that each event sees to event_points.ply"});
  visit("pose_rate_hz", o.pose_rate_hz, About{"poses per second in poses.txt and states.csv; 0: none", "Hz", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, OutputOptions& o) {
  visit("time_unit", o.time_unit, About{"of the times in events.h5"});
  visit("compression", o.compression, About{"of events.h5 and truth.h5"});
  visit("formats", o.formats,
        About{"write these as well: names that esim convert --list prints, such as text, rosbag"});
  visit("preview", o.preview, About{"write preview.mp4 and preview.png"});
}

/// All of a scenario but its cameras, which have two spellings (see read_scenario).
template <class Visitor>
void describe(Visitor& visit, Scenario& o) {
  visit("seed", o.seed, About{"of all random numbers"});
  visit("start_s", o.start_s, About{"where to begin, after the trajectory's start", "s", 0, 1e9});
  visit("duration_s", o.duration_s,
        About{"how long to simulate (default: to the end of the trajectory, or of the layers' keyframes)", "s", 0, 1e9,
              true});
  visit("renderer", o.renderer, About{"what is seen"});
  visit("trajectory", o.trajectory, About{"how the body moves"});
  visit("imu", o.imu, About{"inertial measurement unit; {} for one of default values (default: none)"});
  visit("truth", o.truth, About{"ground truth"});
  visit("output", o.output, About{"what is written, and how"});
}

template <>
inline constexpr std::array<const char*, 2> kEnumNames<LayerUnits>{"pixel", "sensor"};
template <>
inline constexpr std::array<const char*, 4> kEnumNames<LayerBeyond>{"nothing", "clamp", "mirror", "repeat"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<KeyframeInterpolation>{"spline", "linear"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<MeshEngine>{"raycast", "gl", "auto"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<BlenderEngine>{"cycles", "eevee"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<EngineLight>{"auto", "png", "npy"};
template <>
inline constexpr std::array<const char*, 6> kEnumNames<EngineDepth>{"auto",   "plane_depth", "ray_m",
                                                                    "ray_cm", "planar_m",    "planar_cm"};
template <>
inline constexpr std::array<const char*, 4> kEnumNames<EngineMask>{"auto", "png", "npy", "none"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<ColourFilters>{"none", "rggb"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<EventTimeUnit>{"us", "ns"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<EventCompression>{"blosc", "gzip", "none"};

}  // namespace esim

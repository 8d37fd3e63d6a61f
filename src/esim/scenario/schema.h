#pragma once

#include "esim/scenario/scenario.h"

/// The schema: every option of a scenario once, with unit, range and help (see core/describe.h). Options of separate
/// modules, such as the event camera, are described there.
namespace esim::inline scenario {

template <class Visitor>
void describe(Visitor& visit, FileTrajectoryOptions& o) {
  visit("path", o.path, About{"file of poses: TUM text (s) or CSV (ns); the content decides which"});
  visit("time_scale", o.time_scale, About{"factor on the duration: 2 takes twice as long", "", 0, 1e6, true});
  visit("order", o.order, About{"order of the fitted spline: 4 (cubic) to 6", "", 4, 6});
  visit("knot_interval_s", o.knot_interval_s,
        About{"time between the spline's control points; 0: derived from the data", "s", 0, 1e6});
  visit("smoothing_time_s", o.smoothing_time_s,
        About{"time constant of the smoothing, which removes faster motion; 0: no smoothing", "s", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, RandomTrajectoryOptions& o) {
  visit("position_amplitude_m", o.position_amplitude_m,
        About{"maximum translation along the axes x y z of center", "m", 0, 1e6});
  visit("rotation_amplitude_deg", o.rotation_amplitude_deg,
        About{"maximum rotation about the axes x y z of center (for a camera: pitch, yaw, roll)", "deg", 0, 36000});
  visit("knot_interval_s", o.knot_interval_s,
        About{"time between random poses; a smaller value makes the motion faster", "s", 0, 1e6, true});
  visit("center", o.center, About{"mean pose; without an orientation, a body looks along world x"});
  visit("order", o.order, About{"order of the spline: 4 (cubic) to 6", "", 4, 6});
}

template <class Visitor>
void describe(Visitor& visit, StaticTrajectoryOptions& o) {
  visit("pose", o.pose, About{"the constant pose; without an orientation, a body looks along world x"});
}

template <class Visitor>
void describe(Visitor& visit, SceneTrajectoryOptions& o) {
  visit("camera", o.camera,
        About{"camera of the renderer's scene file that gives the motion and the field of view (default: the only "
              "camera)"});
}

template <class Visitor>
void describe(Visitor& visit, WaypointPointOptions& o) {
  visit("position", o.position, About{"position of the body", "m", -1e6, 1e6});
  visit("quaternion", o.quaternion, About{"orientation of the body, Hamilton quaternion x y z w"});
  visit("look_at", o.look_at,
        About{"instead of quaternion: a point on the optical axis of the first camera (for an object: on its z axis)",
              "m", -1e6, 1e6});
  visit("up", o.up, About{"with look_at: the direction that points upwards in the image (default: world z)"});
  visit("t", o.t,
        About{"time at which the body reaches the point; give it for all points or for none", "s", -1e8, 1e8});
  visit("speed", o.speed,
        About{"speed on the way to the next point, if the points have no times (default: the speed of the trajectory)",
              "m/s", 0, 1e6, true});
  visit("pause_s", o.pause_s, About{"time for which the body stands still at the point (default: 0)", "s", 0, 1e8});
}

template <class Visitor>
void describe(Visitor& visit, WaypointTrajectoryOptions& o) {
  visit("file", o.file, About{"instead of points: a YAML file of waypoints, as esim waypoints writes it"});
  visit("points", o.points, About{"two or more waypoints, visited in this order: a list of maps of"});
  visit("speed", o.speed, About{"speed along the path, if the points have no times", "m/s", 0, 1e6, true});
  visit("turn_deg_per_s", o.turn_deg_per_s,
        About{"if the points have no times: turning rate on the spot, and maximum mean turning rate between two points",
              "deg/s", 0, 1e6, true});
  visit("ramp_s", o.ramp_s,
        About{"time to accelerate after standing still, and to brake before it", "s", 0, 1e6, true});
  visit("rest", o.rest, About{"whether the body stands still at the start and at the end"});
  visit("closed", o.closed, About{"whether the path returns to the first point; only if the points have no times"});
}

template <class Visitor>
void describe(Visitor& visit, ObjectOptions& o) {
  visit("name", o.name, About{"unique name in messages and ground truth (default: object0, object1, ...)"});
  visit("scene", o.scene, About{"scene file, in the coordinates of the object"});
  visit("scale", o.scale, About{"factor that converts its coordinates to metres", "", 0, 1e6, true});
  visit("trajectory", o.trajectory, About{"motion: pose of the object's coordinates in the world"});
}

template <class Visitor>
void describe(Visitor& visit, SunOptions& o) {
  visit("direction", o.direction, About{"direction in which the light travels, world frame"});
  visit("strength", o.strength, About{"irradiance of a white surface that faces the sun", "", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, PointLightOptions& o) {
  visit("position", o.position, About{"position, world frame", "m"});
  visit("strength", o.strength,
        About{"irradiance of a white surface that faces the light at a distance of 1 m", "", 0, 1e9});
}

template <class Visitor>
void describe(Visitor&, UnlitOptions&) {}

template <class Visitor>
void describe(Visitor& visit, LambertOptions& o) {
  visit("ambient", o.ambient, About{"irradiance of a white surface that no light reaches", "", 0, 1e6});
  visit("suns", o.suns, About{"directional lights: a list of maps of"});
  visit("points", o.points, About{"point lights, whose irradiance falls with the squared distance: a list of maps of"});
  visit("shadows", o.shadows, About{"whether surfaces cast shadows"});
}

template <class Visitor>
void describe(Visitor& visit, MeshRendererOptions& o) {
  visit("engine", o.engine,
        About{"raycast: Embree; gl: OpenGL; auto: gl if there is a graphics card, raycast otherwise"});
  visit("gl_device", o.gl_device,
        About{"index of the graphics device, from 0 (default: the first hardware device)", "", 0, 31});
  visit("scene", o.scene,
        About{"scene file: GLB, glTF, Blender's .blend, OBJ, PLY, STL, FBX, Collada; its animations are played"});
  visit("time_scale", o.time_scale,
        About{"factor on the duration of the scene file's animation: 2 takes twice as long", "", 0, 1e6, true});
  visit("objects", o.objects, About{"objects that move through the scene: a list of maps of"});
  visit("lighting", o.lighting, About{"unlit: a surface is as bright as its texture, as in scenes with baked light"});
  visit("samples_per_pixel", o.samples_per_pixel,
        About{"rays per pixel at edges: 1, 16 or 64; more rays smooth the edges of objects and shadows", "", 1, 64});
  visit("background", o.background, About{"irradiance of pixels that see no surface", "", 0, 1e6});
}

/// The filters of an image (scene/image_file.h, Softening).
template <class Visitor, class Options>
void describe_softening(Visitor& visit, Options& o) {
  visit("median_px", o.median_px, About{"side of a median filter over the image, odd; 0: no filter", "px", 0, 255});
  visit("gaussian_px", o.gaussian_px,
        About{"standard deviation of a Gaussian blur of the image; 0: no blur", "px", 0, 100});
}

template <class Visitor>
void describe(Visitor& visit, PanoramaRendererOptions& o) {
  visit("image", o.image,
        About{"equirectangular image: its centre lies along world x, its upper edge at the zenith (z)"});
  visit("orientation", o.orientation, About{"orientation of the panorama in the world, quaternion x y z w"});
  describe_softening(visit, o);
}

template <class Visitor>
void describe(Visitor& visit, PlaneRendererOptions& o) {
  visit("image", o.image, About{"image on the plane"});
  visit("width_m", o.width_m, About{"width of the image; the height follows from its aspect ratio", "m", 0, 1e6, true});
  visit("pose", o.pose, About{"pose of the image: origin at its centre, x right, y down, z away from the viewer"});
  visit("endless", o.endless, About{"whether the image is repeated over the infinite plane"});
  describe_softening(visit, o);
  visit("background", o.background, About{"irradiance outside the image", "", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, SpritePose& o) {
  visit("t_s", o.t_s,
        About{"time on the trajectory's clock, which starts at 0 unless the trajectory is a file", "s", -1e8, 1e8});
  visit("position", o.position,
        About{"position of the pivot relative to the sensor's centre, to the right and downwards, in units", "", -1e6,
              1e6});
  visit("rotation_deg", o.rotation_deg, About{"rotation about the pivot, clockwise", "deg", -1e9, 1e9});
  visit("scale", o.scale, About{"factors on width and height; a negative factor mirrors", "", -1e6, 1e6});
  visit("shear", o.shear,
        About{"shift to the right per distance downwards, applied after the scale and before the rotation", "", -1e6,
              1e6});
}

template <class Visitor>
void describe(Visitor& visit, SpriteOptions& o) {
  visit("image", o.image, About{"image file, with or without alpha"});
  visit("units", o.units,
        About{"unit of positions. pixel: at scale 1, a texel is a pixel; sensor: at scale 1, the image fills the "
              "sensor, whose width and height are 1"});
  visit("beyond", o.beyond, About{"what lies beyond the image's edges"});
  describe_softening(visit, o);
  visit("pivot", o.pivot,
        About{"point of the image that the poses place: [0, 0] is its upper left corner, [1, 1] its lower right corner",
              "", -1e3, 1e3});
  visit("interpolation", o.interpolation, About{"motion between poses: natural cubic splines, or linear"});
  visit(
      "poses", o.poses,
      About{
          "in order of time; before the first and after the last, the sprite rests (default: it rests in the middle)"});
}

template <class Visitor>
void describe(Visitor& visit, SpritesRendererOptions& o) {
  visit(
      "scene", o.scene,
      About{"instead of sprites: a .scene file of the original ESIM; it also gives the duration and the camera's size "
            "if the scenario does not"});
  visit("search_path", o.search_path, About{"folders in which esim looks for the scene file's images"});
  visit("sprites", o.sprites, About{"sprites on the sensor, the nearest first"});
  visit("background", o.background, About{"irradiance where no sprite lies", "", 0, 1e6});
}

template <class Visitor>
void describe(Visitor& visit, EngineObjectOptions& o) {
  visit("name", o.name, About{"name of the object in that program"});
  visit("trajectory", o.trajectory, About{"motion: pose of its frame (x forward, y left, z up) in the world"});
}

template <class Visitor>
void describe(Visitor& visit, UnrealcvRendererOptions& o) {
  visit("host", o.host, About{"host that runs the program (default: 127.0.0.1)"});
  visit("port", o.port, About{"port on which the program listens", "", 1, 65535});
  visit(
      "timeout_s", o.timeout_s,
      About{"maximum wait for the connection, for each answer, and for a program that restarts", "s", 0, 86400, true});
  visit("camera", o.camera,
        About{"id of the program's camera that esim moves; it serves all cameras of the rig", "", 0, 1e6});
  visit("objects", o.objects, About{"objects of the program's scene that esim moves: a list of maps of"});
  visit("light", o.light, About{"format of requested images; auto: npy if the program offers it, png otherwise"});
  visit("exposure", o.exposure, About{"factor from the program's linear intensity to irradiance", "", 0, 1e6, true});
  visit("depth", o.depth,
        About{"which depth esim requests, and its meaning; auto: plane_depth if the program offers it, otherwise as "
              "usual for its version"});
  visit("object_mask", o.object_mask,
        About{"format of requested object masks; none: the motion field treats all objects as static"});
  visit("pipelined", o.pipelined,
        About{"whether esim sends all commands of a frame together instead of waiting for each answer"});
  visit("lag_frames", o.lag_frames,
        About{"images to discard after each move, for programs that show a move late", "", 0, 100});
}

template <class Visitor>
void describe(Visitor& visit, BlenderRendererOptions& o) {
  visit("scene", o.scene, About{"file that Blender opens: .blend, .glb, .obj, .ply, .fbx or .dae"});
  visit("address", o.address,
        About{"HOST:PORT of a Blender that already serves; esim then starts none, and that Blender determines scene, "
              "engine, noise_seed and threads"});
  visit("engine", o.engine, About{"cycles: path tracing; eevee: Blender's rasteriser"});
  visit("samples", o.samples,
        About{"light paths per pixel of the sensor; supersampled keyframes divide them among their pixels", "", 1,
              65536});
  visit("noise_seed", o.noise_seed, About{"seed of the path tracer", "", 0, 2147483647});
  visit("threads", o.threads, About{"number of Blender's render threads; 0: all processors", "", 0, 1024});
  visit("objects", o.objects, About{"objects of the scene that esim moves: a list of maps of"});
  visit("exposure", o.exposure, About{"factor from Blender's linear intensity to irradiance", "", 0, 1e6, true});
  visit("timeout_s", o.timeout_s,
        About{"maximum wait for Blender to open the scene, and for each image", "s", 0, 86400, true});
}

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
void describe(Visitor& visit, CameraOptions& o) {
  visit("name", o.name, About{"name, unique within the rig (default: cam0, cam1, ...)"});
  visit("calibration", o.calibration,
        About{"calibration file: a Kalibr camchain or a rig file of the original ESIM; gives size, intrinsics, "
              "distortion and pose of one camera or several"});
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
  visit("T_body_camera", o.T_body_camera, About{"pose of the camera (x right, y down, z forward) in the body"});
  visit("colour", o.colour,
        About{"colour filters of the pixels; rggb: 2 x 2 pattern with red at even columns and rows; none: pixels see "
              "luminance"});
  visit("sampling", o.sampling,
        About{"when esim renders the scene (default: adaptive; flow for renderers of complete images, such as OpenGL; "
              "keyframes if another program renders)"});
  visit("events", o.events, About{"whether the camera has an event sensor; false: it is a standard camera"});
  visit("event_camera", o.event_camera, About{"the event sensor"});
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
  visit("trajectory", o.trajectory, About{"how the body moves"});
  visit("imu", o.imu, About{"inertial measurement unit; {} gives one with default values (default: none)"});
  visit("truth", o.truth, About{"ground truth"});
  visit("output", o.output, About{"files that esim writes"});
}

}  // namespace esim::inline scenario

namespace esim {

template <>
inline constexpr std::array<const char*, 2> kEnumNames<SpriteUnits>{"pixel", "sensor"};
template <>
inline constexpr std::array<const char*, 4> kEnumNames<SpriteBeyond>{"nothing", "clamp", "mirror", "repeat"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<SpriteInterpolation>{"spline", "linear"};
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

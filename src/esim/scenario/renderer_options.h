#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/describe.h"
#include "esim/light/options.h"
#include "esim/scenario/pose_options.h"
#include "esim/scenario/renderers/engine_options.h"
#include "esim/scenario/renderers/lighting_options.h"
#include "esim/scenario/trajectory_options.h"
#include "esim/scene/splats/splats.h"
#include "esim/scene/sprite.h"
#include "esim/scene/vertices/vertex_file.h"

/// What the cameras see. A new renderer is a struct with its describe(), an alternative of the variant at the end, and
/// a function in compose/renderer_factory.cpp.
namespace esim::inline scenario {

/// How the animation of an object's scene file is played.
struct AnimationOptions {
  std::string name{};  ///< empty: all of them
  double time_scale = 1.0;
  double offset_s = 0.0;
  bool repeat = false;
};

template <class Visitor>
void describe(Visitor& visit, AnimationOptions& o) {
  visit(
      "name", o.name,
      About{"of the animation that is played, of a glTF or .blend file with several (default: all that move different "
            "parts)"});
  visit("time_scale", o.time_scale, About{"factor on its duration: 2 takes twice as long", "", 0, 1e6, true});
  visit("offset_s", o.offset_s, About{"time of the animation at which it begins, after its start", "s", 0, 1e6});
  visit("repeat", o.repeat, About{"whether it begins again after its end, instead of resting"});
}

template <class Visitor>
void describe(Visitor& visit, VertexFile& o) {
  visit("file", o.file,
        About{"point cache, .pc2 or .mdd; or numbered meshes, .obj or .ply, with # for the digits: cloth_####.obj"});
  visit("rate_hz", o.rate_hz,
        About{"frames per second; required except for .mdd, which has times", "Hz", 0, 1e6, true});
  visit("axes", o.axes,
        About{"axes of the file. same: as in the scene file; y_up: its (x, y, z) is (x, -z, y) there; left_handed: "
              "its (x, y, z) is (x, z, y) there"});
}

/// A moving object of the scene.
struct ObjectOptions {
  std::string name;
  std::filesystem::path scene;
  double scale = 1.0;
  TrajectoryOptions trajectory;
  AnimationOptions animation{};
  std::optional<FlickerOptions> flicker{};  ///< unset: lit by the light of the scene
  std::optional<VertexFile> vertices{};     ///< unset: those of the scene file
};

template <class Visitor>
void describe(Visitor& visit, ObjectOptions& o) {
  visit("name", o.name, About{"unique name in messages and ground truth (default: object0, object1, ...)"});
  visit("scene", o.scene, About{"scene file, in the coordinates of the object"});
  visit("scale", o.scale, About{"factor that converts its coordinates to metres", "", 0, 1e6, true});
  visit("trajectory", o.trajectory, About{"motion: pose of the object's coordinates in the world"});
  visit("vertices", o.vertices,
        About{"positions of the vertices over time, from another file; the scene file must be an OBJ or PLY file"});
  visit("animation", o.animation,
        About{"how the animations of the scene file, or its vertices, are played; they begin with the body's "
              "trajectory"});
  visit("flicker", o.flicker, About{"makes the object a light of its own, such as a screen or a lamp, that flickers"});
}

/// The renderer of triangles.
enum class MeshEngine { processor, raycast, raster, gl, automatic };

/// Whether it certainly runs on the processor.
inline bool on_processor(MeshEngine engine) { return engine != MeshEngine::gl && engine != MeshEngine::automatic; }

/// Triangles.
struct MeshRendererOptions {
  static constexpr const char* kType = "mesh";
  MeshEngine engine = MeshEngine::processor;
  std::optional<int> gl_device;
  std::filesystem::path scene;
  double time_scale = 1.0;
  std::vector<ObjectOptions> objects;
  LightingOptions lighting;
  int samples_per_pixel = 16;
  double background = 0.2;
};

template <class Visitor>
void describe(Visitor& visit, MeshRendererOptions& o) {
  visit(
      "engine", o.engine,
      About{"raycast: Embree; raster: exact coverage of pixels; processor: raster if samples_per_pixel is above 1 and "
            "the scene has at most 200,000 triangles, raycast otherwise; gl: OpenGL; auto: gl if there is a graphics "
            "card, processor otherwise"});
  visit("gl_device", o.gl_device,
        About{"index of the graphics device, from 0 (default: the first hardware device)", "", 0, 31});
  visit("scene", o.scene,
        About{"scene file: GLB, glTF, Blender's .blend, OBJ, PLY, STL, FBX, Collada; its animations are played"});
  visit("time_scale", o.time_scale,
        About{"factor on the duration of the scene file's animation: 2 takes twice as long", "", 0, 1e6, true});
  visit("objects", o.objects, About{"objects that move through the scene: a list of maps of"});
  visit("lighting", o.lighting, About{"unlit: a surface is as bright as its texture, as in scenes with baked light"});
  visit(
      "samples_per_pixel", o.samples_per_pixel,
      About{
          "1, 16 or 64. Above 1, pixels see their whole area, with this number of rays at edges (raycast, and shadows "
          "of raster). 1 is faster: pixels see only their centres, so that edges move in steps",
          "", 1, 64});
  visit("background", o.background, About{"irradiance of pixels that see no surface", "", 0, 1e6});
}

/// The renderer of splats.
enum class SplatsEngine { processor, gl, automatic };

inline bool on_processor(SplatsEngine engine) { return engine == SplatsEngine::processor; }

/// Gaussian splats, and meshes among them.
struct SplatsRendererOptions {
  static constexpr const char* kType = "splats";
  SplatsEngine engine = SplatsEngine::processor;
  std::optional<int> gl_device;
  std::filesystem::path scene;
  double scale = 1.0;
  std::optional<Eigen::Vector3d> up;
  std::vector<ObjectOptions> objects;
  std::optional<SplatLight> light;
  double display_gamma = 0;
  double gain = 1.0;
  std::optional<SplatFilter> filter;
  SplatProjection projection = SplatProjection::automatic;
  SplatOrder order = SplatOrder::distance;
  LightingOptions lighting;
  double background = 0.0;
};

template <class Visitor>
void describe(Visitor& visit, SplatsRendererOptions& o) {
  visit(
      "engine", o.engine,
      About{"gl: compute shaders of OpenGL, without meshes among the splats; auto: gl if there is a graphics card and "
            "the scene has no meshes, processor otherwise"});
  visit("gl_device", o.gl_device,
        About{"index of the graphics device, from 0 (default: the first hardware device)", "", 0, 31});
  visit("scene", o.scene,
        About{"file of splats: PLY (also compressed), .splat, .spz, .sog, glTF with KHR_gaussian_splatting; or a mesh, "
              "among whose objects are splats"});
  visit("scale", o.scale, About{"factor that converts the scene file's coordinates to metres", "", 0, 1e6, true});
  visit("up", o.up, About{"direction in the scene file that becomes the world's z axis (default: z)"});
  visit("objects", o.objects, About{"objects that move through the scene, splats or meshes: a list of maps of"});
  visit("light", o.light,
        About{"space in which colours are blended. display: sRGB, as in models trained on photographs; linear: linear "
              "light (default: as the file says, otherwise display)"});
  visit("display_gamma", o.display_gamma,
        About{"exponent from display colours to linear light; 0: the sRGB curve", "", 0, 10});
  visit("gain", o.gain, About{"factor from linear light to irradiance", "", 0, 1e6, true});
  visit("filter", o.filter,
        About{"how splats were widened in training. dilated: by 0.3 px² with unchanged opacity; antialiased: by 0.3 "
              "px², their opacity falls; mip: by 0.1 px², their opacity falls (default: as the file says, otherwise "
              "dilated)"});
  visit("projection", o.projection,
        About{"linear: by the pinhole's Jacobian at the centre of each splat; unscented: seven points of each splat, "
              "exactly through the lens; auto: linear without distortion, unscented otherwise"});
  visit(
      "order", o.order,
      About{"order in which splats are blended, by their centres: distance, which does not change when the camera "
            "turns, or depth, as in the original 3D Gaussian splatting, where it does and fires false events; or ray: "
            "in each pixel by the depth of the splats on its ray, several times slower, on the processor only"});
  visit("lighting", o.lighting, About{"of meshes; unlit: a surface is as bright as its texture"});
  visit("background", o.background, About{"irradiance behind everything", "", 0, 1e6});
}

/// The filters of an image (scene/images/image_file.h, Softening).
template <class Visitor, class Options>
void describe_softening(Visitor& visit, Options& o) {
  visit("median_px", o.median_px, About{"side of a median filter over the image, odd; 0: no filter", "px", 0, 255});
  visit("gaussian_px", o.gaussian_px,
        About{"standard deviation of a Gaussian blur of the image; 0: no blur", "px", 0, 100});
}

/// An equirectangular image at infinity.
struct PanoramaRendererOptions {
  static constexpr const char* kType = "panorama";
  std::filesystem::path image;
  Eigen::Vector4d orientation = {0, 0, 0, 1};
  int median_px = 0;
  double gaussian_px = 0;
};

template <class Visitor>
void describe(Visitor& visit, PanoramaRendererOptions& o) {
  visit("image", o.image,
        About{"equirectangular image: its centre lies along world x, its upper edge at the zenith (z)"});
  visit("orientation", o.orientation, About{"orientation of the panorama in the world, quaternion x y z w"});
  describe_softening(visit, o);
}

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
  std::optional<FlickerOptions> flicker{};      // unset: lit by the light of the scene
};

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
  visit("flicker", o.flicker, About{"makes the sprite a light of its own, such as a screen or a lamp, that flickers"});
}

/// Sprites on the sensor. If `scene` is given, they come from that file.
struct SpritesRendererOptions {
  static constexpr const char* kType = "sprites";
  std::filesystem::path scene;
  std::vector<std::filesystem::path> search_path;
  std::vector<SpriteOptions> sprites;
  double background = 0.2;
};

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

using RendererOptions =
    std::variant<MeshRendererOptions, SplatsRendererOptions, PanoramaRendererOptions, PlaneRendererOptions,
                 SpritesRendererOptions, UnrealcvRendererOptions, BlenderRendererOptions>;

/// Whether esim certainly renders on the processor.
inline bool on_processor(const RendererOptions& renderer) {
  return std::visit(
      [](const auto& options) {
        if constexpr (requires { on_processor(options.engine); }) return on_processor(options.engine);
        return true;
      },
      renderer);
}

/// The objects that a scenario adds to the scene file of its renderer; null if it can have none.
inline const std::vector<ObjectOptions>* listed_objects(const RendererOptions& renderer) {
  return std::visit(
      [](const auto& options) -> const std::vector<ObjectOptions>* {
        if constexpr (requires(const std::vector<ObjectOptions>* objects) { objects = &options.objects; }) {
          return &options.objects;
        } else {
          return nullptr;
        }
      },
      renderer);
}

/// The moving objects in the scene of another program that renders; null if esim renders. Renderers of other programs
/// are those with a list of EngineObjectOptions.
inline const std::vector<EngineObjectOptions>* engine_objects(const RendererOptions& renderer) {
  return std::visit(
      [](const auto& options) -> const std::vector<EngineObjectOptions>* {
        if constexpr (requires(const std::vector<EngineObjectOptions>* objects) { objects = &options.objects; }) {
          return &options.objects;
        } else {
          return nullptr;
        }
      },
      renderer);
}

}  // namespace esim::inline scenario

namespace esim {

template <>
inline constexpr std::array<const char*, 3> kEnumNames<VertexAxes>{"same", "y_up", "left_handed"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<SpriteUnits>{"pixel", "sensor"};
template <>
inline constexpr std::array<const char*, 4> kEnumNames<SpriteBeyond>{"nothing", "clamp", "mirror", "repeat"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<SpriteInterpolation>{"spline", "linear"};
template <>
inline constexpr std::array<const char*, 5> kEnumNames<MeshEngine>{"processor", "raycast", "raster", "gl", "auto"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<SplatsEngine>{"processor", "gl", "auto"};
template <>
inline constexpr std::array<const char*, 2> kEnumNames<SplatLight>{"display", "linear"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<SplatFilter>{"dilated", "antialiased", "mip"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<SplatProjection>{"auto", "linear", "unscented"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<SplatOrder>{"distance", "depth", "ray"};

}  // namespace esim

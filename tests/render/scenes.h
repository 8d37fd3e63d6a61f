#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/backends/opengl/gl_renderer.h"
#include "esim/backends/opengl/splats/gl_splat_renderer.h"
#include "esim/backends/panorama/panorama_renderer.h"
#include "esim/backends/plane/plane_renderer.h"
#include "esim/backends/raycast/raster/raster_renderer.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/backends/splats/splat_renderer.h"
#include "esim/backends/sprites/sprites_renderer.h"
#include "esim/geometry/so3.h"
#include "esim/motion/trajectory.h"
#include "esim/render/deforming_surfaces.h"
#include "esim/render/point_spread.h"
#include "esim/scene/deformation/cached_deformation.h"
#include "esim/scene/environment/environment.h"

namespace esim::test {

inline const Workers& two_threads() {
  static const Workers workers(2);
  return workers;
}

/// A smooth texture: low spatial frequencies, so that filtering hardly changes it.
inline float smooth_light(double u, double v) {
  return static_cast<float>(0.5 + 0.2 * std::sin(2 * std::numbers::pi * 3 * u) +
                            0.2 * std::cos(2 * std::numbers::pi * 2 * v));
}

inline Image<float> smooth_image(int width, int height) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = smooth_light((x + 0.5) / width, (y + 0.5) / height);
  }
  return image;
}

inline std::shared_ptr<const Texture> smooth_texture(Wrap wrap_u, Wrap wrap_v) {
  return std::make_shared<const Texture>(smooth_image(1024, 512), wrap_u, wrap_v);
}

/// A box of 8 x 6 x 4 m around the origin, seen from inside, each face textured.
inline Mesh box_mesh() {
  Mesh mesh;
  mesh.materials.push_back({"wall", smooth_texture(Wrap::repeat, Wrap::repeat), 1.0F});
  const Eigen::Vector3f half(4, 3, 2);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      Eigen::Vector3f n = Eigen::Vector3f::Zero(), a = n, b = n;
      n[axis] = side * half[axis];
      a[(axis + 1) % 3] = half[(axis + 1) % 3];
      b[(axis + 2) % 3] = half[(axis + 2) % 3];
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const Eigen::Vector3f& corner : {Eigen::Vector3f(n - a - b), Eigen::Vector3f(n + a - b),
                                            Eigen::Vector3f(n + a + b), Eigen::Vector3f(n - a + b)}) {
        mesh.vertices.push_back(corner);
      }
      const Eigen::Vector2f c00(0, 0), c10(1, 0), c11(1, 1), c01(0, 1);
      mesh.triangles.push_back({first, first + 1, first + 2});
      mesh.texture_uv.push_back({c00, c10, c11});
      mesh.triangles.push_back({first, first + 2, first + 3});
      mesh.texture_uv.push_back({c00, c11, c01});
      mesh.material.insert(mesh.material.end(), {0, 0});
    }
  }
  return mesh;
}

/// The plane of make_renderer("plane"): 5 m wide, 2 m in front of the world's origin along x, slightly tilted.
inline TexturedPlane test_plane() {
  SE3 pose;
  pose.translation = {2.0, 0.1, -0.05};
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // x right = -y, y down = -z, z into the wall = +x
  pose.rotation =
      Eigen::Quaterniond(R) * Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.3, 0.9, 0.1).normalized()));
  return {smooth_texture(Wrap::repeat, Wrap::repeat), pose, 5.0, true, 0.2F};
}

/// The sprites of make_renderer("sprites"): a rectangle that rotates and grows in front of an image that fills the
/// sensor.
inline SpriteScene test_sprites() {
  const auto texture = smooth_texture(Wrap::clamp, Wrap::clamp);
  const auto spline = [](std::vector<SpritePose> poses) { return SpriteMotion(poses, SpriteInterpolation::spline); };
  Sprite near{
      texture, nullptr, SpriteUnits::pixel, SpriteBeyond::nothing,
      spline({{-1, {-60, -20}, -70, {0.04, 0.08}}, {0.1, {5, 3}, 12, {0.06, 0.1}}, {1, {70, 10}, 80, {0.1, 0.1}}})};
  Sprite far{
      texture, nullptr, SpriteUnits::sensor, SpriteBeyond::mirror,
      spline({{-1, {-0.3, 0.2}, 20, {1.5, 2.1}}, {0, {0.05, 0.1}, 5, {1.6, 2}}, {1, {0.4, 0.1}, -20, {1.9, 2}}})};
  return {{near, far}, 0.2F};
}

/// A white ball with the normals of a true one, of 2 n x n quadrilaterals.
inline Mesh ball_mesh(float radius, int n) {
  constexpr float kPi = std::numbers::pi_v<float>;
  Mesh mesh;
  mesh.materials = {{"white", nullptr, 1.0F}};
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= 2 * n; ++i) {
      const float longitude = kPi * static_cast<float>(i) / static_cast<float>(n);
      const float latitude = kPi * (static_cast<float>(j) / static_cast<float>(n) - 0.5F);
      mesh.normals.emplace_back(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                                std::sin(latitude));
      mesh.vertices.push_back(radius * mesh.normals.back());
      if (i == 0 || j == 0) continue;
      const auto corner = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
      const auto above = corner - static_cast<std::uint32_t>(2 * n + 1);
      mesh.triangles.push_back({above - 1, above, corner});
      mesh.triangles.push_back({above - 1, corner, corner - 1});
    }
  }
  const Eigen::Vector2f origin(0, 0);
  mesh.texture_uv.resize(mesh.triangles.size(), {origin, origin, origin});
  mesh.material.resize(mesh.triangles.size(), 0);
  return mesh;
}

/// Small copies of the box, seen from outside, for a scene with two moving objects.
inline Scene moving_scene() {
  Scene scene = still_scene(box_mesh());
  for (const float scale : {0.15F, 0.2F}) {
    SceneObject object{"small box", box_mesh(), true};
    for (Eigen::Vector3f& vertex : object.mesh.vertices) vertex *= scale;
    scene.objects.push_back(object);
  }
  return scene;
}

/// The same, one black and one white, so that only their outlines are visible.
inline Scene plain_moving_scene() {
  Scene scene = moving_scene();
  float base = 0;
  for (SceneObject& object : scene.objects)
    if (object.moves) object.mesh.materials = {{"plain", nullptr, std::exchange(base, 1.0F)}};
  return scene;
}

/// A mesh that shears periodically, so that its flat faces remain flat.
class Swinging final : public Deformation {
 public:
  Swinging(std::vector<Eigen::Vector3f> vertices, float amplitude, float frequency_hz)
      : vertices_(std::move(vertices)), amplitude_(amplitude), frequency_hz_(frequency_hz) {}

  TimeSpan span() const override { return {0, kSecond}; }

  void evaluate(TimeNs t, DeformedVertices& at) const override {
    at.positions.clear(), at.velocities.clear(), at.normals.clear();
    const float omega = 2 * std::numbers::pi_v<float> * frequency_hz_;
    for (const Eigen::Vector3f& vertex : vertices_) {
      const Eigen::Vector3f reach = amplitude_ * vertex.sum() * Eigen::Vector3f(0.6F, -0.5F, 0.8F);
      const float phase = omega * static_cast<float>(to_seconds(t));
      at.positions.push_back(vertex + std::sin(phase) * reach);
      at.velocities.push_back(omega * std::cos(phase) * reach);
    }
  }

 private:
  static constexpr TimeNs kSecond = 1'000'000'000;
  std::vector<Eigen::Vector3f> vertices_;
  float amplitude_, frequency_hz_;
};

/// A deformation as a cache of its vertices, 32 frames per second around kTime.
inline std::shared_ptr<const Deformation> cached(const Deformation& deformation, const Mesh& mesh) {
  constexpr int kFrames = 33;
  constexpr double kRate_hz = 32;
  VertexFrames frames;
  DeformedVertices at;
  for (int i = 0; i < kFrames; ++i) {
    frames.times_s.push_back((i - kFrames / 2) / kRate_hz);
    deformation.evaluate(to_ns(frames.times_s.back()), at);
    frames.positions.insert(frames.positions.end(), at.positions.begin(), at.positions.end());
  }
  std::vector<std::uint32_t> numbers(mesh.vertices.size());
  std::iota(numbers.begin(), numbers.end(), 0U);
  return std::make_shared<const CachedDeformation>(VertexSpline(std::move(frames)), numbers, ShadingNormals(mesh));
}

/// The same as moving_scene(), with boxes that also deform: the first by a formula, the second by a cache of it.
inline Scene deforming_scene() {
  Scene scene = moving_scene();
  const auto swinging = [](const Mesh& mesh) { return std::make_shared<const Swinging>(mesh.vertices, 0.15F, 1.5F); };
  SceneObject &first = scene.objects.at(1), &second = scene.objects.at(2);
  first.deformation = swinging(first.mesh);
  second.deformation = cached(*swinging(second.mesh), second.mesh);
  return scene;
}

/// A smooth equirectangular image without a seam.
inline Image<float> smooth_sky(int height) {
  Image<float> image(2 * height, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < 2 * height; ++x) {
      const double longitude = std::numbers::pi * (1 - (x + 0.5) / height);
      const double latitude = std::numbers::pi * (0.5 - (y + 0.5) / height), c = std::cos(latitude);
      image(x, y) = static_cast<float>(0.6 + 0.3 * c * std::cos(longitude) - 0.2 * c * std::sin(longitude) +
                                       0.25 * std::sin(latitude) + 0.3 * c * c * std::cos(2 * longitude));
    }
  }
  return image;
}

/// The walls shine, with smooth textures of every parameter, and the objects are metals of two roughnesses, under every
/// kind of light; one object carries a lamp.
inline Scene glossy_moving_scene() {
  Scene scene = moving_scene();
  Gloss wall;
  wall.roughness_texture = wall.metallic_texture = smooth_texture(Wrap::repeat, Wrap::repeat);
  Image<float> across = smooth_image(256, 256), upright = across;
  for (float& n : across.pixels()) n = 0.5F + 0.2F * (n - 0.5F);
  for (float& n : upright.pixels()) n = 0.99F;
  const auto texture = [](const Image<float>& image) {
    return std::make_shared<const Texture>(image, Wrap::repeat, Wrap::repeat);
  };
  wall.normal_textures = {texture(across), texture(across), texture(upright)};
  scene.objects[0].mesh.materials[0].gloss = std::make_shared<const Gloss>(wall);
  scene.objects[1].mesh.materials[0].gloss = std::make_shared<const Gloss>(Gloss{1, 0.35F});
  scene.objects[2].mesh.materials[0].gloss = std::make_shared<const Gloss>(Gloss{0, 0.5F});
  Lighting& lighting = scene.lighting.emplace();
  lighting.glossy = true;
  lighting.ambient = 0.05F;
  lighting.suns.push_back({{0.5F, 0.3F, -1}, 0.4F});
  lighting.points.push_back({{0.3F, -0.5F, 0.9F}, 2, {{{0, 0.5F}, {1, 2}}}});
  lighting.points.push_back({{0, 0, 1.2F}, 1, {}, 1});
  AreaLight area;
  area.position = {0.5F, 0, 1.9F}, area.strength = 2;
  lighting.areas.push_back(area);
  static const auto sky = std::make_shared<const Environment>(Planes{smooth_sky(64)}, 0.5F, 0.3, "sky");
  lighting.environment = sky;
  return scene;
}

/// The surfaces of a mesh with smooth_texture(), covered with flat splats on a lattice, at most `spacing` apart.
inline Splats splats_of(const Mesh& mesh, float spacing) {
  Splats splats;
  splats.light = SplatLight::linear;
  splats.filter = SplatFilter::antialiased;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto corner = [&](std::size_t k) { return mesh.vertices[mesh.triangles[i][k]]; };
    const Eigen::Vector3f a = corner(1) - corner(0), b = corner(2) - corner(0);
    Eigen::Matrix3f R;
    R.col(0) = a.normalized(), R.col(2) = a.cross(b).normalized(), R.col(1) = R.col(2).cross(R.col(0));
    const Eigen::Quaternionf q(R);
    const int n = static_cast<int>(std::ceil(std::max(a.norm(), b.norm()) / spacing));
    for (int v = 0; v < n; ++v) {
      for (int u = 0; u < n - v; ++u) {
        const float x = (static_cast<float>(u) + 1.0F / 3) / static_cast<float>(n);
        const float y = (static_cast<float>(v) + 1.0F / 3) / static_cast<float>(n);
        const auto& uv = mesh.texture_uv[i];
        const Eigen::Vector2f at = uv[0] + x * (uv[1] - uv[0]) + y * (uv[2] - uv[0]);
        const float light = smooth_light(double{at.x()}, double{at.y()});
        splats.positions.push_back(corner(0) + x * a + y * b);
        splats.deviations.emplace_back(0.6F * a.norm() / static_cast<float>(n), 0.6F * b.norm() / static_cast<float>(n),
                                       0.0F);
        splats.rotations.push_back(q.coeffs());
        splats.opacities.push_back(0.98F);
        for (int colour = 0; colour < 3; ++colour) splats.harmonics.push_back((light - 0.5F) / 0.28209479F);
      }
    }
  }
  return splats;
}

/// moving_scene() of splats.
inline std::vector<SplatObject> splat_objects(bool moving) {
  const auto make = [](float scale) {
    Mesh mesh = box_mesh();
    for (Eigen::Vector3f& vertex : mesh.vertices) vertex *= scale;
    return std::make_shared<const Splats>(splats_of(mesh, scale < 1 ? 0.014F : 0.08F));
  };
  std::vector<SplatObject> objects{{make(1)}};
  if (moving) objects.insert(objects.end(), {{make(0.15F), 0}, {make(0.2F), 1}});
  return objects;
}

/// Their motion, with constant twists, in front of the moving camera.
inline std::vector<Kinematics> moving_objects(double t_s) {
  Kinematics left, right;
  left.T_world_body = {so3_exp(Eigen::Vector3d(0.3, 0.5, -0.2)), {1.7, 0.4, 0.1}};
  left.velocity_world = {-0.8, 0.3, 0.9};
  left.omega_body = {0.5, -1.2, 0.8};
  right.T_world_body = {so3_exp(Eigen::Vector3d(-0.1, 0.9, 1.2)), {2.4, -0.7, -0.2}};
  right.velocity_world = {0.2, 1.1, -0.4};
  right.omega_body = {-0.9, 0.3, 1.5};
  for (Kinematics* object : {&left, &right}) {
    object->T_world_body.translation += object->velocity_world * t_s;
    object->T_world_body.rotation = object->T_world_body.rotation * so3_exp(object->omega_body * t_s);
  }
  return {left, right};
}

/// False if OpenGL is not available.
inline bool has_gl() { return !gl_devices().empty(); }

/// The renderers that make_renderer() makes: those of a 3D scene, and those that draw on the sensor. "moving": two
/// objects move; "deforming": they also deform; "blurred": the lens blurs.
inline constexpr std::array kRenderersOfSpace = {"panorama",
                                                 "plane",
                                                 "mesh",
                                                 "moving_mesh",
                                                 "deforming_mesh",
                                                 "raster",
                                                 "moving_raster",
                                                 "deforming_raster",
                                                 "gl",
                                                 "moving_gl",
                                                 "deforming_gl",
                                                 "splats",
                                                 "moving_splats",
                                                 "blurred_panorama",
                                                 "moving_blurred_raster",
                                                 "deforming_blurred_raster",
                                                 "moving_glossy_mesh",
                                                 "moving_glossy_raster",
                                                 "moving_glossy_gl"};
inline constexpr std::array kRenderersOnSensor = {"sprites", "blurred_sprites"};

/// Every renderer on a scene that fills the view from near the origin. Those of `gl` and `sprites` ignore `area`.
inline std::unique_ptr<Renderer> make_renderer(const std::string& name, const Camera& camera,
                                               const Workers& workers = two_threads(), const PixelArea& area = {}) {
  constexpr std::string_view kBlurred = "blurred_";
  if (const std::size_t at = name.find(kBlurred); at != std::string::npos) {
    const std::string sharp = name.substr(0, at) + name.substr(at + kBlurred.size());
    const auto make_sharp = [&](const Camera& larger) { return make_renderer(sharp, larger, workers, area); };
    return with_point_spread(make_sharp, camera, 0.8, true, workers);
  }
  constexpr auto kNone = ColourFilters::none;
  if (name == "panorama") {
    return make_panorama_renderer({smooth_texture(Wrap::repeat, Wrap::clamp)}, camera, workers, kNone, area.texture);
  }
  if (name == "plane") return make_plane_renderer(test_plane(), camera, workers, kNone, area.texture);
  if (name == "sprites") return make_sprites_renderer(test_sprites(), camera, workers);
  if (name.ends_with("splats")) {
    static const auto still = build_splat_scene(splat_objects(false)), moving = build_splat_scene(splat_objects(true));
    return make_splat_renderer(name == "splats" ? still : moving, {}, camera, workers, kNone, area.texture);
  }
  if (name.ends_with("splats_gl")) return make_gl_splat_renderer(splat_objects(true), {}, camera, {}, area.texture);
  const Scene scene = name.starts_with("deforming")       ? deforming_scene()
                      : name.starts_with("moving_glossy") ? glossy_moving_scene()
                      : name.starts_with("moving")        ? moving_scene()
                                                          : still_scene(box_mesh());
  if (name.ends_with("gl")) return make_gl_renderer(scene, {}, camera);
  if (name.ends_with("raster"))
    return make_raster_renderer(build_raster_scene(scene), {}, camera, workers, kNone, area);
  return make_raycast_renderer(build_raycast_scene(scene), {}, camera, workers, kNone, area);
}

/// The moving objects of that scene.
inline std::vector<Kinematics> objects_of(const std::string& name, double t_s = 0) {
  const bool moving = name.starts_with("moving") || name.starts_with("deforming");
  return moving ? moving_objects(t_s) : std::vector<Kinematics>();
}

/// The surfaces of a scene in which all moving objects deform, by evaluating one point after the other.
class DeformingSurfacesOf final : public DeformingSurfaces {
 public:
  explicit DeformingSurfacesOf(const Scene& scene) : scene_(scene) {}

  std::size_t triangle_count(std::size_t object) const override {
    return scene_.objects[scene_.objects.size() - 3 + object].mesh.triangles.size();  // two objects move
  }

  void locate(std::size_t object, TimeNs t, std::span<const SurfacePoint> points,
              std::span<Eigen::Vector3f> positions) const override {
    std::size_t moving = 0;
    for (const SceneObject& candidate : scene_.objects) {
      if (!candidate.moves || ++moving != object) continue;
      DeformedVertices at;
      candidate.deformation->evaluate(t, at);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const auto& [a, b, c] = candidate.mesh.triangles[points[i].triangle];
        const float first = 1 - points[i].b1 - points[i].b2;
        positions[i] = first * at.positions[a] + points[i].b1 * at.positions[b] + points[i].b2 * at.positions[c];
      }
    }
  }

 private:
  Scene scene_;
};

/// How the objects of that scene deform; null if they are rigid.
inline std::shared_ptr<const DeformingSurfaces> deforming_surfaces_of(const std::string& name) {
  if (!name.starts_with("deforming")) return nullptr;
  return std::make_shared<const DeformingSurfacesOf>(deforming_scene());
}

/// A camera with strong distortion of each kind, 120 x 90.
inline Camera distorted_camera(int kind) {
  Camera camera{120, 90, 99.7, 99.9, 61.3, 44.2, NoDistortion{}};
  if (kind == 1) camera.distortion = RadialTangential{-0.3829, 0.1893, -0.001, -0.00056, 0.0};
  if (kind == 2) camera.distortion = Equidistant{-0.1385, -0.0415, 0.0081, 0.0042};
  if (kind == 3) camera.distortion = Fov{0.93};
  return camera;
}

/// Near the origin, looking along world x, and moving in all six degrees of freedom; `dt_s` later, its twist being
/// constant.
inline Kinematics moving_camera(double dt_s = 0) {
  Kinematics camera;
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_world_body.rotation =
      Eigen::Quaterniond(R) * Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d(1, -2, 0.5).normalized()));
  camera.T_world_body.translation = {0.2, -0.1, 0.15};
  camera.velocity_world = {0.4, -0.7, 0.5};
  camera.omega_body = {0.8, -0.5, 1.1};
  camera.T_world_body.translation += camera.velocity_world * dt_s;
  camera.T_world_body.rotation = camera.T_world_body.rotation * so3_exp(camera.omega_body * dt_s);
  return camera;
}

/// The time of the test.
inline constexpr TimeNs kTime = 123;
inline constexpr double kTime_s = 123e-9;

/// The scene at a time that is `dt_s` seconds after that of the test.
inline Sample render(Renderer& renderer, const Camera& model, const Kinematics& camera,
                     const std::vector<Kinematics>& objects = {}, std::vector<Tile> tiles = {}, double dt_s = 0) {
  if (tiles.empty()) tiles = {{0, 0, model.width, model.height}};
  Sample sample;
  renderer.render({kTime + to_ns(dt_s), camera, std::move(tiles), objects}, sample);
  return sample;
}

}  // namespace esim::test

#include "esim/backends/opengl/lighting/gl_shadows.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/gl_shaders.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {
namespace {

constexpr int kLargestMap = 4096;                                        // texels
constexpr double kMaxStillTexels = 1 << 26, kMaxMovingTexels = 1 << 23;  // of all layers, 4 bytes each
constexpr int kMargin = 4;          // texels around a view: more than the radius of the filter
constexpr double kNearLamp = 1e-3;  // m
constexpr int kFaces = 6;

/// One view, as in the shader's struct of this name.
struct ShadowView {
  Eigen::Matrix4f clip_from_camera, camera_from_clip;
  float texel[4];
};

/// Rows: two axes perpendicular to the light, and its direction.
Eigen::Matrix3d across(const SunLight& sun) {
  const Eigen::Vector3d along = sun.direction.cast<double>().normalized();
  Eigen::Matrix3d axes;
  axes.row(0) = along.unitOrthogonal();
  axes.row(2) = along;
  axes.row(1) = along.cross(axes.row(0).transpose());
  return axes;
}

/// A sun's view of a box in its frame. Depth is 1 where the light enters, 0 at the opposite side.
Eigen::Matrix4d sun_clip(const Eigen::Matrix3d& axes, const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d size = box.sizes(), centre = box.center();
  Eigen::Matrix4d clip = Eigen::Matrix4d::Identity();
  clip.block<1, 3>(0, 0) = 2 / size.x() * axes.row(0), clip(0, 3) = -2 * centre.x() / size.x();
  clip.block<1, 3>(1, 0) = 2 / size.y() * axes.row(1), clip(1, 3) = -2 * centre.y() / size.y();
  clip.block<1, 3>(2, 0) = -axes.row(2) / size.z(), clip(2, 3) = box.max().z() / size.z();
  return clip;
}

/// A point light's view along one axis of the world: a square of slightly more than 90 degrees.
Eigen::Matrix4d face_clip(const Eigen::Vector3d& light, int face, double tangent) {
  const int axis = face / 2;
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip(0, (axis + 1) % 3) = 1 / tangent;
  clip(1, (axis + 2) % 3) = 1 / tangent;
  clip(3, axis) = face % 2 == 0 ? 1 : -1;
  clip.col(3) = -(clip.leftCols<3>() * light);
  clip(2, 3) = kNearLamp;
  return clip;
}

/// Whether a ball may intersect a view, which is -w <= x <= w and -w <= y <= w in clip space.
bool sees(const Eigen::Matrix4d& clip_from_world, const Eigen::Vector3d& centre, double radius) {
  const Eigen::Vector4d at = clip_from_world * centre.homogeneous();
  const auto change_per_m = [&](int row) { return clip_from_world.row(row).head<3>().norm(); };
  const double w = at.w() + radius * change_per_m(3);  // the largest in the ball
  return w > 0 && std::fabs(at.x()) - radius * change_per_m(0) < w && std::fabs(at.y()) - radius * change_per_m(1) < w;
}

/// Enlarges boxes that have no extent in a direction.
Eigen::AlignedBox3d with_some_size(Eigen::AlignedBox3d box) {
  const Eigen::Vector3d min = Eigen::Vector3d::Constant(1e-6 * (1 + box.center().lpNorm<1>()));
  return {box.min() - min, box.max() + min};
}

}  // namespace

GlShadows::GlShadows(const Scene& scene, const GlScene& drawn) : drawn_(drawn), lighting_(*scene.lighting) {
  GLint max_layers = 0;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  layers_ = static_cast<int>(lighting_.suns.size() + kFaces * lighting_.points.size());
  if (layers_ > max_layers) {
    throw UserError("gl: too many lights cast shadows: their shadow maps need more than the device's " +
                    std::to_string(max_layers) +
                    " layers (six for each point light); use fewer lights, or engine: raycast");
  }
  if (std::any_of(lighting_.points.begin(), lighting_.points.end(),
                  [](const PointLight& light) { return light.object.has_value(); })) {
    throw UserError(
        "gl: the shadows of lights that objects carry are not supported by shadow maps; use engine: raycast, or "
        "shadows: false");
  }
  for (const SceneObject& object : scene.objects) {
    if (!object.moves) continue;
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& vertex : object.mesh.vertices) box.extend(vertex);
    double radius = 0;
    const Eigen::Vector3f centre = box.center();
    for (const Eigen::Vector3f& vertex : object.mesh.vertices)
      radius = std::max(radius, double{(vertex - centre).norm()});
    balls_.push_back({centre.cast<double>(), radius});
  }
  program_ = make_program({kShadowMapVertexShader}, {kShadowMapFragmentShader});
  glCreateFramebuffers(1, &framebuffer_);
  glNamedFramebufferDrawBuffer(framebuffer_, GL_NONE);
  glNamedFramebufferReadBuffer(framebuffer_, GL_NONE);
  glCreateBuffers(1, &views_);
  if (layers_ == 0) return;

  still_ = make_maps(kMaxStillTexels);
  for (const SunLight& sun : lighting_.suns) still_.views.push_back(still_sun(scene, sun));
  view_points(still_);
  if (!balls_.empty()) moving_ = make_maps(kMaxMovingTexels);
  std::vector<Placed> objects;
  for (const GlScene::Object& object : drawn_.objects()) {
    if (!object.moves) objects.push_back({&object, Eigen::Matrix4d::Identity()});
  }
  draw_views(still_, objects);
}

/// Layers of the largest power of two that have at most `max_texels` in total.
GlShadows::Maps GlShadows::make_maps(double max_texels) const {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  Maps maps;
  maps.size = kLargestMap;
  while (maps.size > 256 && (maps.size > largest || 1.0 * maps.size * maps.size * layers_ > max_texels)) maps.size /= 2;
  glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &maps.texture);
  glTextureStorage3D(maps.texture, 1, GL_DEPTH_COMPONENT32F, maps.size, maps.size, layers_);
  for (const GLenum direction : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTextureParameteri(maps.texture, direction, GL_CLAMP_TO_EDGE);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTextureParameteri(maps.texture, filter, GL_NEAREST);
  throw_on_gl_error("allocating shadow maps");
  return maps;
}

/// A sun's view of all static objects.
GlShadows::View GlShadows::still_sun(const Scene& scene, const SunLight& sun) const {
  const Eigen::Matrix3d axes = across(sun);
  Eigen::AlignedBox3d box;
  for (const SceneObject& object : scene.objects) {
    if (object.moves) continue;
    for (const Eigen::Vector3f& vertex : object.mesh.vertices) box.extend(axes * vertex.cast<double>());
  }
  if (box.isEmpty()) return {};
  box = with_some_size(box);
  const Eigen::Vector3d texel = box.sizes() / (still_.size - 2 * kMargin);
  const Eigen::Vector3d margin = kMargin * Eigen::Vector3d(texel.x(), texel.y(), 0);
  return {sun_clip(axes, {box.min() - margin, box.max() + margin}), std::max(texel.x(), texel.y()), true};
}

/// A sun's view of all moving objects, with `balls` in the world frame. Its texels have few different sizes, and lie at
/// integer multiples of these, so that the shadow of an object at rest does not change while other objects move.
GlShadows::View GlShadows::moving_sun(const std::vector<Ball>& balls, const SunLight& sun) const {
  const Eigen::Matrix3d axes = across(sun);
  Eigen::AlignedBox3d box;
  for (const Ball& ball : balls) {
    const Eigen::Vector3d centre = axes * ball.centre, reach = Eigen::Vector3d::Constant(ball.radius);
    box.extend(centre - reach), box.extend(centre + reach);
  }
  box = with_some_size(box);
  const double wanted = std::max(box.sizes().x(), box.sizes().y()) / (moving_.size - 2 * kMargin);
  const double texel = std::exp2(std::ceil(2 * std::log2(wanted)) / 2), width = texel * moving_.size;
  for (const int axis : {0, 1}) {
    box.min()[axis] = texel * (std::floor(box.min()[axis] / texel) - kMargin + 1);
    box.max()[axis] = box.min()[axis] + width;
  }
  return {sun_clip(axes, box), texel, true};
}

/// Adds the views of the point lights: squares slightly wider than 90 degrees, so that the filter stays within one.
void GlShadows::view_points(Maps& maps) const {
  const double tangent = maps.size / (maps.size - 2.0 * kMargin);
  for (const PointLight& light : lighting_.points) {
    for (int face = 0; face < kFaces; ++face) {
      maps.views.push_back({face_clip(light.position.cast<double>(), face, tangent), 2 * tangent / maps.size, true});
    }
  }
}

void GlShadows::draw_views(const Maps& maps, const std::vector<Placed>& objects) const {
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  glDepthFunc(GL_GREATER);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(-2, 0);  // away from the light, by the slope over two texels
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, maps.size, maps.size);
  glScissor(0, 0, maps.size, maps.size);
  glUseProgram(program_);
  glBindVertexArray(drawn_.vertices());
  for (std::size_t layer = 0; layer < maps.views.size(); ++layer) {
    const View& view = maps.views[layer];
    if (!view.used) continue;
    glNamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, maps.texture, 0, static_cast<GLint>(layer));
    constexpr GLfloat kNothing = 0;
    glClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &kNothing);
    for (const Placed& placed : objects) {
      const Eigen::Matrix4f matrix = (view.clip_from_world * placed.world_from_object).cast<float>();
      glUniformMatrix4fv(location(program_, "clip_from_object"), 1, GL_FALSE, matrix.data());
      const auto& parts = placed.object->parts;
      if (!parts.empty())
        glDrawArrays(GL_TRIANGLES, parts.front().first, parts.back().first + parts.back().count - parts.front().first);
    }
  }
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_TEST);
}

/// The ball of a moving object, in its frame.
GlShadows::Ball GlShadows::ball_of(std::size_t moving, TimeNs t) const {
  for (const GlDeformingObject& object : drawn_.deforming()) {
    if (object.number() != moving + 1) continue;
    const auto [centre, radius] = object.ball(t);
    return {centre.cast<double>(), double{radius}};
  }
  return balls_[moving];
}

void GlShadows::draw(const RenderRequest& request) {
  T_world_camera_ = request.camera.T_world_body;
  moving_.views.clear();
  if (!balls_.empty() && layers_ > 0) {
    std::vector<Ball> balls;
    std::vector<Placed> objects;
    for (const GlScene::Object& object : drawn_.objects()) {
      if (!object.moves) continue;
      const SE3& pose = request.objects[balls.size()].T_world_body;
      const Ball ball = ball_of(balls.size(), request.t);
      balls.push_back({pose * ball.centre, ball.radius});
      objects.push_back({&object, pose.matrix()});
    }
    for (const SunLight& sun : lighting_.suns) moving_.views.push_back(moving_sun(balls, sun));
    view_points(moving_);
    for (View& view : moving_.views) {
      view.used = std::any_of(balls.begin(), balls.end(),
                              [&](const Ball& ball) { return sees(view.clip_from_world, ball.centre, ball.radius); });
    }
    draw_views(moving_, objects);
  }
  upload_views(request.camera.T_world_body);
}

void GlShadows::upload_views(const SE3& T_world_camera) const {
  std::vector<ShadowView> views(static_cast<std::size_t>(2 * std::max(layers_, 1)));
  const auto fill = [&](const Maps& maps, std::size_t first) {
    for (std::size_t i = 0; i < maps.views.size(); ++i) {
      const View& view = maps.views[i];
      if (!view.used) continue;
      const Eigen::Matrix4d clip_from_camera = view.clip_from_world * T_world_camera.matrix();
      views[first + i] = {clip_from_camera.cast<float>(),
                          clip_from_camera.inverse().cast<float>(),
                          {static_cast<float>(view.texel), 1, 0, 0}};
    }
  };
  for (ShadowView& view : views) view = {Eigen::Matrix4f::Zero(), Eigen::Matrix4f::Zero(), {0, 0, 0, 0}};
  fill(still_, 0);
  fill(moving_, static_cast<std::size_t>(layers_));
  glNamedBufferData(views_, static_cast<GLsizeiptr>(views.size() * sizeof(ShadowView)), views.data(), GL_STREAM_DRAW);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kShadowViewsBinding, views_);
}

void GlShadows::bind_to(GLuint program) const {
  glBindTextureUnit(kStillShadows, still_.texture);
  glBindTextureUnit(kMovingShadows, moving_.texture);
  set(program, "shadow_layers", layers_);
  set(program, "shadow_suns", static_cast<int>(lighting_.suns.size()));
  const Eigen::Matrix3f R = T_world_camera_.rotation.toRotationMatrix().cast<float>();
  glUniformMatrix3fv(location(program, "world_from_camera"), 1, GL_FALSE, R.data());
  set(program, "camera_to_origin", static_cast<float>(T_world_camera_.translation.lpNorm<1>()));
}

}  // namespace esim::inline backends::inline opengl

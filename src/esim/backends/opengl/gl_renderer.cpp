#include "esim/backends/opengl/gl_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "esim/backends/opengl/gl_borrowed.h"
#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/gl_read_back.h"
#include "esim/backends/opengl/gl_scene.h"
#include "esim/backends/opengl/gl_shaders.h"
#include "esim/backends/opengl/gl_targets.h"
#include "esim/backends/opengl/lighting/gl_gloss.h"
#include "esim/backends/opengl/lighting/gl_shadows.h"
#include "esim/core/error.h"
#include "esim/render/bands.h"
#include "esim/render/motion_field.h"
#include "esim/render/pinhole_view.h"

namespace esim::inline backends::inline opengl {
namespace {

constexpr float kNear = 1e-3F;  // m

// Data of the shaders, which have structs of the same names.
struct ShaderTwist {
  float v[4];
  float omega[4];
};
struct ShaderLight {
  float place[4];
  float strength[4];
};

PinholeView require_pinhole(const Camera& camera, const PixelRays& rays) {
  try {
    return pinhole_view(camera, rays, Pinhole::any);
  } catch (const UserError& error) {
    throw UserError(std::string("gl: ") + error.what() + "; use engine: raycast");
  }
}

/// Clip coordinates x, y = (clip[0], clip[1]) X, Y + (clip[2], clip[3]) Z.
std::array<float, 4> clip_of(const PinholeView& view) {
  // Pixel centres are at integers: pixel u spans [u - 0.5, u + 0.5].
  return {static_cast<float>(2 * view.fx / view.width), static_cast<float>(2 * view.fy / view.height),
          static_cast<float>((2 * view.cx + 1) / view.width - 1),
          static_cast<float>((2 * view.cy + 1) / view.height - 1)};
}

/// The passes are: draw the surfaces into a pinhole image; resolve its samples into pixels; if the lens distorts, look
/// these up in the distorted image. The last pass writes E, Z and V once per pixel, for any number of triangles.
class GlRenderer final : public Renderer {
 public:
  GlRenderer(const Scene& scene, const GlOptions& options, const Camera& camera)
      : lighting_(scene.lighting), camera_(camera), options_(options), context_(options.device) {
    const PixelRays rays(camera);
    view_ = require_pinhole(camera, rays);
    clip_ = clip_of(view_);
    const GlContext::Use use(context_);
    require_size();
    samples_ = offered_samples(options.samples_per_pixel);
    scene_.emplace(scene);
    if (deforms()) rays_ = rays;
    if (lighting_ && lighting_->shadows) shadows_.emplace(scene, *scene_);
    if (lighting_ && lighting_->glossy) gloss_.emplace(*lighting_, *scene_);
    make_passes();
    if (view_.looked_up) upload_lens(rays);
    glCreateVertexArrays(1, &no_vertices_);
    glCreateBuffers(1, &lights_);
    glCreateBuffers(1, &twists_);
    throw_on_gl_error("preparing the renderer");
  }

  RendererTraits traits() const override {
    return {.name = "mesh",
            .granularity = Granularity::tile,
            .at_infinity = false,
            .device = "OpenGL, " + context_.name(),
            .deforms = deforms()};
  }

  std::unique_ptr<Rendering> start(RenderRequest request) override {
    if (request.objects.size() != moving_count())
      throw InternalError("the number of objects in a request must be the number of moving objects in the scene");
    const GlContext::Use use(context_);
    set_up(request);
    GlDeformed deformed = scene_->deform(request.t);
    if (shadows_) shadows_->draw(request);
    draw_surfaces(request);
    for (const Tile& tile : request.tiles) complete(tile);
    auto under_way = std::make_unique<UnderWay>(*this, std::move(request), std::move(deformed));
    under_way->read_back->start(view_.looked_up ? distorted_ : resolved_, under_way->request.tiles,
                                under_way->request.wants_objects());
    throw_on_gl_error("rendering");
    return under_way;
  }

 private:
  /// A frame that the device renders.
  struct UnderWay final : Rendering {
    UnderWay(GlRenderer& from, RenderRequest asked, GlDeformed objects)
        : renderer(from), request(std::move(asked)), deformed(std::move(objects)), read_back(from.idle_) {}

    void finish(Sample& sample) override {
      prepare({&request, 1}, renderer.camera_.width, renderer.camera_.height, sample, renderer.deforms());
      const GlContext::Use use(renderer.context_);
      read_back->finish(sample);
      throw_on_gl_error("reading an image back");
      if (!deformed.empty())
        complete_deforming(renderer.scene_->deforming(), deformed, request, *renderer.rays_, sample);
    }

    GlRenderer& renderer;
    RenderRequest request;
    GlDeformed deformed;
    GlBorrowed<GlReadBack> read_back;
  };

  bool deforms() const { return !scene_->deforming().empty(); }

  std::size_t moving_count() const {
    const auto& objects = scene_->objects();
    return static_cast<std::size_t>(
        std::count_if(objects.begin(), objects.end(), [](const auto& o) { return o.moves; }));
  }

  void require_size() const {
    GLint largest = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    if (std::max(view_.width, view_.height) <= largest) return;
    throw UserError("gl: this camera's view needs a pinhole image of " + std::to_string(view_.width) + " x " +
                    std::to_string(view_.height) + " pixels, but the device supports at most " +
                    std::to_string(largest) + "; use engine: raycast");
  }

  void make_passes() {
    const GLenum floats = view_.looked_up ? GL_RGBA32F : GL_RG32F;  // a lens needs the slope of 1 / Z
    ShaderSource surfaces = {kMeanShader, kSurfaceFragmentShader}, resolve = {kResolveFragmentShader};
    if (shadows_) surfaces.insert(surfaces.begin(), kShadowShader);
    if (gloss_) surfaces.insert(surfaces.begin(), kGlossyDefinition), surfaces.push_back(kGlossyShader);
    ShaderSource vertices = {kSurfaceVertexShader}, distort = {kLastPassShader, kDistortFragmentShader};
    if (deforms()) {
      for (ShaderSource* source : {&vertices, &surfaces, &resolve, &distort}) source->insert(source->begin(), kDeforms);
    }
    surface_program_ = make_program(vertices, surfaces);
    surfaces_ = GlTarget::make(view_.width, view_.height, samples_, true, floats, deforms());
    if (resolves()) {
      if (!view_.looked_up) resolve.insert(resolve.begin(), kLastPassShader);
      if (samples_ > 1) resolve.insert(resolve.begin(), kSeveralSamples);
      resolve_program_ = make_program({kWholeImageVertexShader}, resolve);
      resolved_ = GlTarget::make(view_.width, view_.height, 1, false, GL_RGBA32F, deforms());
    }
    if (view_.looked_up) {
      distort_program_ = make_program({kWholeImageVertexShader}, distort);
      distorted_ = GlTarget::make(camera_.width, camera_.height, 1, false, GL_RGBA32F, deforms());
    }
  }
  bool resolves() const { return samples_ > 1 || !view_.looked_up; }

  void upload_lens(const PixelRays& rays) {
    const auto upload = [&](GLenum format, GLenum layout, const std::vector<float>& values) {
      GLuint name = 0;
      glCreateTextures(GL_TEXTURE_2D, 1, &name);
      glTextureStorage2D(name, 1, format, camera_.width, camera_.height);
      glTextureSubImage2D(name, 0, 0, 0, camera_.width, camera_.height, layout, GL_FLOAT, values.data());
      return name;
    };
    std::vector<float> bearings, jacobians;
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        bearings.insert(bearings.end(), {rays.x(x, y), rays.y(x, y)});
        jacobians.insert(jacobians.end(), {rays.du_dx(x, y), rays.dv_dx(x, y), rays.du_dy(x, y), rays.dv_dy(x, y)});
      }
    }
    centres_ = upload(GL_RG32F, GL_RG, view_.centres);
    footprints_ = upload(GL_RGBA32F, GL_RGBA, view_.footprints);
    bearings_ = upload(GL_RG32F, GL_RG, bearings);
    jacobians_ = upload(GL_RGBA32F, GL_RGBA, jacobians);
  }

  /// Sets what is the same for all tiles: state, poses, twists, lights.
  void set_up(const RenderRequest& request) {
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDepthFunc(GL_GREATER);
    glDisable(GL_CULL_FACE);
    glEnable(GL_SCISSOR_TEST);

    T_camera_world_ = request.camera.T_world_body.inverse();
    upload_twists(request);
    upload_lights(request);
  }

  void upload_twists(const RenderRequest& request) const {
    std::vector<ShaderTwist> twists;
    for (const auto& [v, omega] : relative_twists(request))
      twists.push_back({{v.x(), v.y(), v.z(), 0}, {omega.x(), omega.y(), omega.z(), 0}});
    upload(twists, twists_, kTwistsBinding);
  }

  void upload_lights(const RenderRequest& request) {
    std::vector<ShaderLight> lights;
    if (lighting_) {
      std::vector<SE3> objects;
      for (const Kinematics& object : request.objects) objects.push_back(object.T_world_body);
      const Lighting now = lighting_at(*lighting_, request.t, objects);
      if (gloss_) gloss_->upload(now, T_camera_world_);
      const Eigen::Matrix3d R = T_camera_world_.rotation.toRotationMatrix();
      for (const SunLight& sun : now.suns) {
        const Eigen::Vector3f to = -(R * sun.direction.cast<double>().normalized()).cast<float>();
        lights.push_back({{to.x(), to.y(), to.z(), 0}, {sun.strength, 0, 0, 0}});
      }
      for (const PointLight& light : now.points) {
        const Eigen::Vector3f at = (T_camera_world_ * light.position.cast<double>()).cast<float>();
        lights.push_back({{at.x(), at.y(), at.z(), 1}, {light.strength, 0, 0, 0}});
      }
    }
    light_count_ = static_cast<int>(lights.size());
    lights.resize(std::max<std::size_t>(lights.size(), 1));
    upload(lights, lights_, kLightsBinding);
  }

  template <typename T>
  static void upload(const std::vector<T>& values, GLuint buffer, GLuint binding) {
    glNamedBufferData(buffer, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), GL_STREAM_DRAW);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer);
  }

  /// The passes after the surfaces, for a tile.
  void complete(const Tile& tile) const {
    const GlTarget* shown = &surfaces_;
    if (resolves()) {
      begin_pass(resolved_, view_.part_for(tile), resolve_program_);
      glBindTextureUnit(kSeen, surfaces_.seen);
      glBindTextureUnit(kWhich, surfaces_.which);
      if (deforms()) glBindTextureUnit(kPoints, surfaces_.place);
      set(resolve_program_, "samples", samples_);
      const auto f = [](double value) { return static_cast<float>(value); };
      glUniform4f(location(resolve_program_, "pinhole"), f(camera_.fx), f(camera_.fy), f(camera_.cx), f(camera_.cy));
      draw_whole();
      shown = &resolved_;
    }
    if (!view_.looked_up) return;
    begin_pass(distorted_, tile, distort_program_);
    glBindTextureUnit(kSeen, shown->seen);
    glBindTextureUnit(kWhich, shown->which);
    if (deforms()) glBindTextureUnit(kPoints, shown->place);
    glBindTextureUnit(kCentres, centres_);
    glBindTextureUnit(kFootprints, footprints_);
    glBindTextureUnit(kBearings, bearings_);
    glBindTextureUnit(kJacobians, jacobians_);
    draw_whole();
  }

  /// Draws the scene once; a stencil prevents shading of pixels outside the request's tiles.
  void draw_surfaces(const RenderRequest& request) const {
    clear_surfaces(request.tiles);
    if (gloss_) gloss_->draw_sky(view_, no_vertices_);
    const GLuint program = surface_program_;
    glUseProgram(program);
    glEnable(GL_DEPTH_TEST);
    glBindVertexArray(scene_->vertices());
    glUniform4fv(location(program, "clip"), 1, clip_.data());
    set(program, "near", kNear);
    set(program, "ambient", lighting_ ? lighting_->ambient : 0.0F);
    set(program, "light_count", light_count_);
    if (shadows_) shadows_->bind_to(program);
    if (gloss_) gloss_->bind_to(program);
    std::size_t moving = 0;
    for (const GlScene::Object& object : scene_->objects()) {
      const SE3 pose = object.moves ? T_camera_world_ * request.objects[moving].T_world_body : T_camera_world_;
      const Eigen::Matrix4f matrix = pose.matrix().cast<float>();
      glUniformMatrix4fv(location(program, "camera_from_object"), 1, GL_FALSE, matrix.data());
      glUniform1ui(location(program, "object"), object.moves ? static_cast<GLuint>(++moving) : 0U);
      for (const GlScene::Part& surface : object.parts) {
        if (deforms()) set(program, "first_triangle", object.before(surface) / 3);
        draw_part(surface);
      }
    }
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_STENCIL_TEST);
  }

  /// Clears the tiles, and restricts drawing to them.
  void clear_surfaces(const std::vector<Tile>& tiles) const {
    const GLuint target = surfaces_.framebuffer;
    const GLfloat background[] = {options_.background, 0, 0, 0};
    const GLuint none[] = {0, 0, 0, 0};
    const Tile all{0, 0, view_.width, view_.height};
    begin_pass(surfaces_, all, surface_program_);
    if (tiles.size() > 1) glClearNamedFramebufferfi(target, GL_DEPTH_STENCIL, 0, 0, 0);
    for (const Tile& tile : tiles) {
      const Tile part = view_.part_for(tile);
      glScissor(part.x, part.y, part.width, part.height);
      glClearNamedFramebufferfv(target, GL_COLOR, 0, background);
      glClearNamedFramebufferuiv(target, GL_COLOR, 1, none);
      glClearNamedFramebufferfi(target, GL_DEPTH_STENCIL, 0, 0, 1);
    }
    if (tiles.size() > 1) {
      glScissor(all.x, all.y, all.width, all.height);
      glEnable(GL_STENCIL_TEST);
      glStencilFunc(GL_EQUAL, 1, 1);
    }
  }

  void draw_part(const GlScene::Part& part) const {
    const GLuint program = surface_program_;
    glBindTextureUnit(kBaseTexture, part.base_texture);
    glBindTextureUnit(kEmissionTexture, part.emission_texture);
    set(program, "has_base_texture", static_cast<int>(part.base_texture != 0));
    set(program, "has_emission_texture", static_cast<int>(part.emission_texture != 0));
    set(program, "base", part.base);
    set(program, "emission", part.emission);
    set(program, "lit", static_cast<int>(lighting_.has_value() && !part.unlit));
    if (gloss_) gloss_->bind_part(program, part);
    glDrawArrays(GL_TRIANGLES, part.first, part.count);
  }

  void begin_pass(const GlTarget& target, const Tile& part, GLuint program) const {
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    glViewport(0, 0, target.width, target.height);
    glScissor(part.x, part.y, part.width, part.height);
    glUseProgram(program);
  }
  void draw_whole() const {
    glBindVertexArray(no_vertices_);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  std::optional<Lighting> lighting_;
  Camera camera_;
  GlOptions options_;
  GlContext context_;
  PinholeView view_;
  std::array<float, 4> clip_{};
  int samples_ = 1;
  std::optional<GlScene> scene_;
  std::optional<PixelRays> rays_;  // if objects deform
  std::optional<GlShadows> shadows_;
  std::optional<GlGloss> gloss_;
  GlTarget surfaces_, resolved_, distorted_;
  GLuint surface_program_ = 0, resolve_program_ = 0, distort_program_ = 0;
  GLuint centres_ = 0, footprints_ = 0, bearings_ = 0, jacobians_ = 0;
  GLuint no_vertices_ = 0, lights_ = 0, twists_ = 0;
  std::vector<std::unique_ptr<GlReadBack>> idle_;

  // State of the current request.
  SE3 T_camera_world_;
  int light_count_ = 0;
};

}  // namespace

std::unique_ptr<Renderer> make_gl_renderer(const Scene& scene, const GlOptions& options, const Camera& camera) {
  return std::make_unique<GlRenderer>(scene, options, camera);
}

}  // namespace esim::inline backends::inline opengl

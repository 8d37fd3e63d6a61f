#include "esim/backends/opengl/gl_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/gl_scene.h"
#include "esim/backends/opengl/gl_targets.h"
#include "esim/backends/opengl/pinhole_view.h"
#include "esim/core/error.h"
#include "esim/render/bands.h"

namespace esim {
namespace {

constexpr float kNear = 1e-3F;  // m

/// One light for the shader: see its struct of this name.
struct ShaderLight {
  float place[4];
  float strength[4];
};

/// Passes one after the other: surfaces into a pinhole image; its samples into pixels, where it has several; these into
/// the distorted image, where the lens distorts.
class GlRenderer final : public Renderer {
 public:
  GlRenderer(std::shared_ptr<const Scene> scene, const GlOptions& options, const Camera& camera, const Workers& workers)
      : lighting_(scene->lighting), options_(options), context_(options.device), rays_(camera), workers_(workers) {
    view_ = pinhole_view(camera, rays_);
    const GlContext::Use use(context_);
    require_size();
    samples_ = offered_samples(options.samples_per_pixel);
    scene_.emplace(*scene);
    surfaces_ = GlTarget::make(view_.width, view_.height, samples_, true, view_.distorts);
    surface_program_ = make_program(kSurfaceVertexShader, kSurfaceFragmentShader);
    if (samples_ > 1) {
      resolved_ = GlTarget::make(view_.width, view_.height, 1, false, view_.distorts);
      resolve_program_ = make_program(kWholeImageVertexShader, kResolveFragmentShader);
    }
    if (view_.distorts) {
      distorted_ = GlTarget::make(camera.width, camera.height, 1, false, false);
      distort_program_ = make_program(kWholeImageVertexShader, kDistortFragmentShader);
      upload_view();
    }
    glCreateVertexArrays(1, &no_vertices_);
    glCreateBuffers(1, &lights_);
    throw_on_gl_error("preparing the renderer");
  }

  RendererTraits traits() const override {
    return {
        .name = "mesh", .granularity = Granularity::tile, .at_infinity = false, .device = "OpenGL, " + context_.name()};
  }

  void render(const RenderRequest& request, Sample& sample) override {
    {
      const GlContext::Use use(context_);
      set_up(request);
      draw_surfaces(request);
      for (const Tile& tile : request.tiles) finish(tile);
      fetch(request, sample);
      throw_on_gl_error("rendering");
    }
    add_motion_field(request, rays_, workers_, sample);
  }

 private:
  void require_size() const {
    GLint largest = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    if (std::max(view_.width, view_.height) <= largest) return;
    throw UserError("gl: this camera's view needs a pinhole image of " + std::to_string(view_.width) + " x " +
                    std::to_string(view_.height) + " pixels, the device has " + std::to_string(largest) +
                    "; use engine: raycast");
  }

  void upload_view() {
    const auto upload = [](GLenum format, GLenum layout, const std::vector<float>& values, int width, int height) {
      GLuint name = 0;
      glCreateTextures(GL_TEXTURE_2D, 1, &name);
      glTextureStorage2D(name, 1, format, width, height);
      glTextureSubImage2D(name, 0, 0, 0, width, height, layout, GL_FLOAT, values.data());
      return name;
    };
    const int width = rays_.x.width(), height = rays_.x.height();
    centres_ = upload(GL_RG32F, GL_RG, view_.centres, width, height);
    footprints_ = upload(GL_RGBA32F, GL_RGBA, view_.footprints, width, height);
  }

  /// What is the same for all tiles: state, poses, lights.
  void set_up(const RenderRequest& request) {
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDepthFunc(GL_GREATER);
    glDisable(GL_CULL_FACE);
    glEnable(GL_SCISSOR_TEST);

    T_camera_world_ = request.camera.T_world_body.inverse();
    std::vector<ShaderLight> lights;
    if (lighting_) {
      const Eigen::Matrix3d R = T_camera_world_.rotation.toRotationMatrix();
      for (const SunLight& sun : lighting_->suns) {
        const Eigen::Vector3f to = -(R * sun.direction.cast<double>().normalized()).cast<float>();
        lights.push_back({{to.x(), to.y(), to.z(), 0}, {sun.strength, 0, 0, 0}});
      }
      for (const PointLight& light : lighting_->points) {
        const Eigen::Vector3f at = (T_camera_world_ * light.position.cast<double>()).cast<float>();
        lights.push_back({{at.x(), at.y(), at.z(), 1}, {light.strength, 0, 0, 0}});
      }
    }
    light_count_ = static_cast<int>(lights.size());
    lights.resize(std::max<std::size_t>(lights.size(), 1));
    glNamedBufferData(lights_, static_cast<GLsizeiptr>(lights.size() * sizeof(ShaderLight)), lights.data(),
                      GL_STREAM_DRAW);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kLightsBinding, lights_);
  }

  /// The passes after the surfaces, for a tile.
  void finish(const Tile& tile) {
    const GlTarget* shown = &surfaces_;
    if (samples_ > 1) {
      begin_pass(resolved_, view_.part_for(tile), resolve_program_);
      bind(resolve_program_, "seen_samples", 0, surfaces_.seen);
      bind(resolve_program_, "which_samples", 1, surfaces_.which);
      set(resolve_program_, "samples", samples_);
      draw_whole();
      shown = &resolved_;
    }
    if (!view_.distorts) return;
    begin_pass(distorted_, tile, distort_program_);
    bind(distort_program_, "pinhole_seen", 0, shown->seen);
    bind(distort_program_, "pinhole_which", 1, shown->which);
    bind(distort_program_, "centres", 2, centres_);
    bind(distort_program_, "footprints", 3, footprints_);
    draw_whole();
  }

  /// Draws the scene once, wherever the request's tiles are: a stencil keeps pixels between them from being shaded.
  void draw_surfaces(const RenderRequest& request) {
    const GLuint target = surfaces_.framebuffer;
    const GLfloat background[] = {options_.background, 0, 0, 0};
    const GLuint none[] = {0, 0, 0, 0};
    const Tile all{0, 0, view_.width, view_.height};
    begin_pass(surfaces_, all, surface_program_);
    if (request.tiles.size() > 1) glClearNamedFramebufferfi(target, GL_DEPTH_STENCIL, 0, 0, 0);
    for (const Tile& tile : request.tiles) {
      const Tile part = view_.part_for(tile);
      glScissor(part.x, part.y, part.width, part.height);
      glClearNamedFramebufferfv(target, GL_COLOR, 0, background);
      glClearNamedFramebufferuiv(target, GL_COLOR, 1, none);
      glClearNamedFramebufferfi(target, GL_DEPTH_STENCIL, 0, 0, 1);
    }
    if (request.tiles.size() > 1) {
      glScissor(all.x, all.y, all.width, all.height);
      glEnable(GL_STENCIL_TEST);
      glStencilFunc(GL_EQUAL, 1, 1);
    }
    glEnable(GL_DEPTH_TEST);
    glBindVertexArray(scene_->vertices());
    const GLuint program = surface_program_;
    glUniform4fv(location(program, "pinhole"), 1, view_.clip.data());
    set(program, "near", kNear);
    set(program, "ambient", lighting_ ? lighting_->ambient : 0.0F);
    set(program, "light_count", light_count_);
    std::size_t moving = 0;
    for (const GlScene::Object& object : scene_->objects()) {
      const SE3 pose = object.moves ? T_camera_world_ * request.objects[moving].T_world_body : T_camera_world_;
      const Eigen::Matrix4f matrix = pose.matrix().cast<float>();
      glUniformMatrix4fv(location(program, "camera_from_object"), 1, GL_FALSE, matrix.data());
      glUniform1ui(location(program, "object"), object.moves ? static_cast<GLuint>(++moving) : 0U);
      for (const GlScene::Part& surface : object.parts) draw_part(surface);
    }
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_STENCIL_TEST);
  }

  void draw_part(const GlScene::Part& part) const {
    const GLuint program = surface_program_;
    bind(program, "base_texture", 0, part.base_texture);
    bind(program, "emission_texture", 1, part.emission_texture);
    set(program, "has_base_texture", static_cast<int>(part.base_texture != 0));
    set(program, "has_emission_texture", static_cast<int>(part.emission_texture != 0));
    set(program, "base", part.base);
    set(program, "emission", part.emission);
    set(program, "lit", static_cast<int>(lighting_.has_value() && !part.unlit));
    glDrawArrays(GL_TRIANGLES, part.first, part.count);
  }

  static void begin_pass(const GlTarget& target, const Tile& part, GLuint program) {
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    glViewport(0, 0, target.width, target.height);
    glScissor(part.x, part.y, part.width, part.height);
    glUseProgram(program);
  }
  void draw_whole() const {
    glBindVertexArray(no_vertices_);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  static GLint location(GLuint program, const char* name) { return glGetUniformLocation(program, name); }
  static void set(GLuint program, const char* name, float value) { glUniform1f(location(program, name), value); }
  static void set(GLuint program, const char* name, int value) { glUniform1i(location(program, name), value); }
  static void bind(GLuint program, const char* name, GLuint unit, GLuint texture) {
    set(program, name, static_cast<int>(unit));
    glBindTextureUnit(unit, texture);
  }

  /// Copies the tiles into buffers while the device goes on with the next, then takes them from there.
  void fetch(const RenderRequest& request, Sample& sample) {
    prepare(request, rays_.x.width(), rays_.x.height(), sample);
    const bool with_objects = !request.objects.empty();
    const GlTarget& shown = view_.distorts ? distorted_ : (samples_ > 1 ? resolved_ : surfaces_);
    std::size_t pixels = 0;
    for (const Tile& tile : request.tiles) pixels += static_cast<std::size_t>(tile.width * tile.height);
    seen_.make_room(pixels * 2 * sizeof(float));
    which_.make_room(pixels * sizeof(std::uint16_t));

    glBindFramebuffer(GL_READ_FRAMEBUFFER, shown.framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    std::size_t offset = 0;
    for (const Tile& tile : request.tiles) {
      seen_.read(GL_COLOR_ATTACHMENT0, tile, GL_RG, GL_FLOAT, offset * 2 * sizeof(float));
      if (with_objects) {
        which_.read(GL_COLOR_ATTACHMENT1, tile, GL_RED_INTEGER, GL_UNSIGNED_SHORT, offset * sizeof(std::uint16_t));
      }
      offset += static_cast<std::size_t>(tile.width * tile.height);
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);

    const auto* seen = static_cast<const float*>(seen_.map());
    const auto* which = with_objects ? static_cast<const std::uint16_t*>(which_.map()) : nullptr;
    for (const Tile& tile : request.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        float *const irradiance = sample.irradiance.row(y) + tile.x, *const depth = sample.depth.row(y) + tile.x;
        for (int x = 0; x < tile.width; ++x) irradiance[x] = seen[2 * x], depth[x] = 1.0F / seen[2 * x + 1];
        seen += 2 * tile.width;
        if (!with_objects) continue;
        std::copy_n(which, tile.width, sample.object.row(y) + tile.x);
        which += tile.width;
      }
    }
    seen_.unmap();
    if (with_objects) which_.unmap();
  }

  /// A buffer that the device writes pixels to and the processor reads them from.
  class PixelBuffer {
   public:
    void make_room(std::size_t bytes) {
      if (bytes <= size_) return;
      if (name_ != 0) glDeleteBuffers(1, &name_);
      glCreateBuffers(1, &name_);
      glNamedBufferStorage(name_, static_cast<GLsizeiptr>(bytes), nullptr, GL_MAP_READ_BIT);
      size_ = bytes;
    }
    void read(GLenum attachment, const Tile& tile, GLenum layout, GLenum type, std::size_t offset) const {
      glReadBuffer(attachment);
      glBindBuffer(GL_PIXEL_PACK_BUFFER, name_);
      glReadPixels(tile.x, tile.y, tile.width, tile.height, layout, type, reinterpret_cast<void*>(offset));
    }
    const void* map() const {
      const void* const data = glMapNamedBufferRange(name_, 0, static_cast<GLsizeiptr>(size_), GL_MAP_READ_BIT);
      if (data == nullptr) throw_on_gl_error("reading an image back");
      if (data == nullptr) throw InternalError("gl: an image cannot be read back");
      return data;
    }
    void unmap() const { glUnmapNamedBuffer(name_); }

   private:
    GLuint name_ = 0;
    std::size_t size_ = 0;
  };

  std::optional<Lighting> lighting_;
  GlOptions options_;
  GlContext context_;
  PixelRays rays_;
  const Workers& workers_;
  PinholeView view_;
  int samples_ = 1;
  std::optional<GlScene> scene_;
  GlTarget surfaces_, resolved_, distorted_;
  GLuint surface_program_ = 0, resolve_program_ = 0, distort_program_ = 0;
  GLuint centres_ = 0, footprints_ = 0, no_vertices_ = 0, lights_ = 0;
  PixelBuffer seen_, which_;

  // Of the request that is being rendered.
  SE3 T_camera_world_;
  int light_count_ = 0;
};

}  // namespace

std::unique_ptr<Renderer> make_gl_renderer(std::shared_ptr<const Scene> scene, const GlOptions& options,
                                           const Camera& camera, const Workers& workers) {
  if (scene->lighting && scene->lighting->shadows)
    throw UserError("gl: it casts no shadows; set lighting.shadows: false, or use engine: raycast");
  return std::make_unique<GlRenderer>(std::move(scene), options, camera, workers);
}

}  // namespace esim

#include "esim/backends/opengl/splats/gl_splat_renderer.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "esim/backends/opengl/gl_borrowed.h"
#include "esim/backends/opengl/gl_buffer.h"
#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/splats/gl_splat_lists.h"
#include "esim/backends/opengl/splats/gl_splat_scene.h"
#include "esim/backends/opengl/splats/gl_splat_shaders.h"
#include "esim/core/error.h"
#include "esim/geometry/distortion.h"
#include "esim/render/bands.h"
#include "esim/render/motion_field.h"
#include "esim/scene/splats/display_curve.h"
#include "esim/scene/splats/splat_rules.h"

namespace esim::inline backends::inline opengl {
namespace {

constexpr std::size_t kScreenSplatBytes = 16 * sizeof(float);
constexpr std::size_t kHeaderBytes = 16;  // of an image that is read back: the number of items that it needed

/// The parameters of a lens, as the shader expects them.
struct LensParameters {
  using Values = std::array<float, 5>;

  static Values of(const Distortion& distortion) { return std::visit(LensParameters{}, distortion); }

  Values operator()(const NoDistortion&) const { return {}; }
  Values operator()(const RadialTangential& d) const { return floats(d.k1, d.k2, d.p1, d.p2, d.k3); }
  Values operator()(const Equidistant& d) const { return floats(d.k1, d.k2, d.k3, d.k4, 0); }
  Values operator()(const Fov& d) const { return floats(2 * std::tan(d.w / 2), 1 / d.w, 0, 0, 0); }

 private:
  static Values floats(double a, double b, double c, double d, double e) {
    return {static_cast<float>(a), static_cast<float>(b), static_cast<float>(c), static_cast<float>(d),
            static_cast<float>(e)};
  }
};

class GlSplatRenderer final : public Renderer {
 public:
  GlSplatRenderer(const std::vector<SplatObject>& objects, const SplatOptions& options, const Camera& camera,
                  std::optional<int> device, double footprint)
      : camera_(camera), rays_(camera), pixel_area_(static_cast<float>(footprint * footprint)), context_(device) {
    for (const SplatObject& object : objects) {
      if (object.moving) moving_ = std::max(moving_, *object.moving + 1);
    }
    const GlContext::Use use(context_);
    scene_.emplace(objects);
    columns_ = divided_up(camera.width), rows_ = divided_up(camera.height);
    lists_.emplace(scene_->size(), columns_, rows_);
    on_screen_.make_room(scene_->size() * kScreenSplatBytes);
    require_gl_items(pixels(), 3 * sizeof(float));
    image_.make_room(3 * pixels() * sizeof(float));
    make_projection(options);
    make_blending(options, objects.empty() ? SplatLight::display : objects[0].splats->light);
    throw_on_gl_error("preparing the renderer");
  }

  RendererTraits traits() const override {
    return {.name = "splats",
            .granularity = Granularity::frame,
            .at_infinity = false,
            .has_edges = false,
            .device = "OpenGL, " + context_.name()};
  }

  std::unique_ptr<Rendering> start(RenderRequest request) override {
    if (request.objects.size() < moving_)
      throw InternalError("the number of objects in a request must be the number of moving objects in the scene");
    const GlContext::Use use(context_);
    auto under_way = std::make_unique<UnderWay>(*this, std::move(request));
    submit(*under_way);
    return under_way;
  }

 private:
  /// Images that are read back: a buffer to which the device writes them, and the fence after that.
  struct ReadBack {
    GlBuffer buffer{GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT};
    GLsync done = nullptr;
  };

  /// A frame that the device renders.
  struct UnderWay final : Rendering {
    UnderWay(GlSplatRenderer& from, RenderRequest asked)
        : renderer(from), request(std::move(asked)), read_back(from.idle_) {}

    void finish(Sample& sample) override {
      prepare({&request, 1}, renderer.camera_.width, renderer.camera_.height, sample);
      const GlContext::Use use(renderer.context_);
      while (!renderer.collect(*this, sample)) renderer.submit(*this);
    }

    GlSplatRenderer& renderer;
    RenderRequest request;
    GlBorrowed<ReadBack> read_back;
    GLuint max_items = 0;  // in the lists when the device was told to render
  };

  static GLuint divided_up(int pixels) { return static_cast<GLuint>((pixels + kGlBin - 1) / kGlBin); }
  std::size_t pixels() const {
    return static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height);
  }

  void make_projection(const SplatOptions& options) {
    const bool undistorted = std::holds_alternative<NoDistortion>(camera_.distortion);
    const bool linear = options.projection == SplatProjection::linear ||
                        (options.projection == SplatProjection::automatic && undistorted);
    const std::string lens = fmt::format("#define LENS {}\n", linear ? 0 : 1 + camera_.distortion.index());
    const std::string rules = gl_splat_rules();
    project_ = make_compute_program({lens.c_str(), rules.c_str(), kProjectShader});
    Eigen::Vector2f limit(0, 0);
    float widest = 0;
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        const Eigen::Vector2f bearing(rays_.x(x, y), rays_.y(x, y));
        limit = limit.cwiseMax(bearing.cwiseAbs()), widest = std::max(widest, bearing.norm());
      }
    }
    limit *= kLinearLimit;
    const auto f = [](double value) { return static_cast<float>(value); };
    const LensParameters::Values values = LensParameters::of(camera_.distortion);
    glUseProgram(project_);
    glUniform2i(location(project_, "size"), camera_.width, camera_.height);
    glUniform2f(location(project_, "focal"), f(camera_.fx), f(camera_.fy));
    glUniform2f(location(project_, "principal"), f(camera_.cx), f(camera_.cy));
    glUniform2f(location(project_, "limit"), limit.x(), limit.y());
    glUniform1fv(location(project_, "lens"), static_cast<GLsizei>(values.size()), values.data());
    set(project_, "domain", std::min(f(domain_radius(camera_.distortion)), kUnscentedLimit * widest));
    set(project_, "by_depth", static_cast<int>(options.order == SplatOrder::depth));
  }

  void make_blending(const SplatOptions& options, SplatLight light) {
    const std::string rules = gl_splat_rules();
    blend_ = make_compute_program({rules.c_str(), kBlendShader});
    const DisplayCurve curve(light, options.display_gamma);
    const std::vector<float>& table = curve.table();
    curve_.make_room(table.size() * sizeof(float));
    glNamedBufferSubData(curve_.name(), 0, static_cast<GLsizeiptr>(table.size() * sizeof(float)), table.data());
    glUseProgram(blend_);
    glUniform2i(location(blend_, "size"), camera_.width, camera_.height);
    set(blend_, "behind", curve.encoded(options.background / options.gain));
    set(blend_, "gain", options.gain);
    set(blend_, "curve_steps", table.empty() ? 0U : static_cast<GLuint>(table.size() - 1));
    set(blend_, "display_gamma", static_cast<float>(options.display_gamma));
  }

  /// Gives the device everything that it must do for an image.
  void submit(UnderWay& under_way) {
    under_way.max_items = lists_->max_items();
    lists_->bind_for_projection();
    on_screen_.bind(kOnScreen);
    scene_->project(project_, under_way.request, pixel_area_);
    gl_barrier();
    lists_->make();
    image_.bind(kImage);
    curve_.bind(kCurve);
    glUseProgram(blend_);
    glDispatchCompute(columns_, rows_, 1);
    gl_barrier();

    ReadBack& read_back = *under_way.read_back;
    const std::size_t bytes = (under_way.request.wants_objects() ? 3 : 2) * pixels() * sizeof(float);
    read_back.buffer.make_room(kHeaderBytes + bytes);
    lists_->copy_wanted(read_back.buffer.name());
    glCopyNamedBufferSubData(image_.name(), read_back.buffer.name(), 0, kHeaderBytes, static_cast<GLsizeiptr>(bytes));
    if (read_back.done != nullptr) glDeleteSync(read_back.done);
    read_back.done = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();  // otherwise nothing would begin before finish()
    throw_on_gl_error("rendering");
  }

  /// Waits for the image and writes it to the sample. False if the lists were too short for it: they are longer now.
  bool collect(UnderWay& under_way, Sample& sample) {
    ReadBack& read_back = *under_way.read_back;
    wait_for(read_back.done);
    const auto* data = static_cast<const std::byte*>(read_back.buffer.map());
    std::uint32_t wanted = 0;
    std::memcpy(&wanted, data, sizeof wanted);
    const bool complete = wanted <= under_way.max_items;
    if (complete) write(under_way.request, data + kHeaderBytes, sample);
    read_back.buffer.unmap();
    throw_on_gl_error("reading an image back");
    if (wanted > lists_->max_items()) lists_->make_room(wanted);
    return complete;
  }

  void write(const RenderRequest& request, const std::byte* image, Sample& sample) const {
    const auto* irradiance = reinterpret_cast<const float*>(image);
    const auto* nearness = irradiance + pixels();
    const auto* object = reinterpret_cast<const std::uint32_t*>(nearness + pixels());
    const std::vector<Twist> twists = relative_twists(request);
    for (const Tile& tile : request.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        const std::size_t first =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(tile.x);
        std::copy_n(irradiance + first, tile.width, sample.irradiance.row(y) + tile.x);
        std::transform(nearness + first, nearness + first + tile.width, sample.depth.row(y) + tile.x,
                       [](float near) { return near > 0 ? 1 / near : std::numeric_limits<float>::infinity(); });
        if (sample.object.empty()) continue;
        std::transform(object + first, object + first + tile.width, sample.object.row(y) + tile.x,
                       [](std::uint32_t which) { return static_cast<std::uint16_t>(which); });
      }
      motion_field(rays_, twists, tile, sample, request.motion_rows);
    }
  }

  Camera camera_;
  PixelRays rays_;
  float pixel_area_;
  GlContext context_;
  std::size_t moving_ = 0;
  GLuint columns_ = 0, rows_ = 0;  // bins
  std::optional<GlSplatScene> scene_;
  std::optional<GlSplatLists> lists_;
  GlBuffer on_screen_, image_, curve_{GL_DYNAMIC_STORAGE_BIT};
  GLuint project_ = 0, blend_ = 0;
  std::vector<std::unique_ptr<ReadBack>> idle_;
};

}  // namespace

std::unique_ptr<Renderer> make_gl_splat_renderer(const std::vector<SplatObject>& objects, const SplatOptions& options,
                                                 const Camera& camera, std::optional<int> device, double footprint) {
  if (options.order == SplatOrder::ray)
    throw UserError("splats by OpenGL: the order must be distance or depth, not ray; use the processor's renderer");
  return std::make_unique<GlSplatRenderer>(objects, options, camera, device, footprint);
}

}  // namespace esim::inline backends::inline opengl

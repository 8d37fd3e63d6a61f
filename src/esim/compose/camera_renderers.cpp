#include "esim/compose/camera_renderers.h"

#include <fmt/format.h>

#include <cmath>

#include "esim/core/engine_error.h"
#include "esim/render/point_spread.h"

namespace esim::inline compose {

CameraRenderers::CameraRenderers(const RendererFactory& factory, const CameraOptions& options, const Camera& model,
                                 bool sees_more, const Workers& workers)
    : factory_(factory), options_(options), model_(model), sees_more_(sees_more), workers_(workers) {
  const auto refuse = [&](const char* option, const char* beside) {
    throw UserError(
        fmt::format("camera {}: {} cannot be used with {}; remove one of them", options.name, option, beside));
  };
  if (options.psf_px > 0 && sees_colour(options)) refuse("psf_px", "colour filters");
  if (options.fill_factor < 1 && sees_colour(options)) refuse("fill_factor", "colour filters");
  if (options.fill_factor < 1 && std::holds_alternative<KeyframeSampling>(options.sampling))
    refuse("fill_factor", "keyframes");
}

std::unique_ptr<Renderer> CameraRenderers::make() const {
  std::optional<PixelArea> area;
  if (const double side = std::sqrt(options_.fill_factor); side < 1) area = PixelArea{side, side};
  std::unique_ptr<Renderer> renderer;
  try {
    renderer = make(model_, area);
  } catch (const EngineError&) {
    throw;
  } catch (const UserError& error) {
    if (!sees_colour(options_) && options_.psf_px == 0) throw;
    throw UserError(fmt::format("camera {}: {}", options_.name, error.what()));
  }
  if (renderer == nullptr) {
    throw UserError(
        fmt::format("camera {}: fill_factor: the pixels of this renderer see their whole area; use 1, or a mesh with "
                    "engine raycast or raster, a plane or a panorama",
                    options_.name));
  }
  return renderer;
}

std::unique_ptr<Renderer> CameraRenderers::make(const Camera& camera, const std::optional<PixelArea>& area) const {
  const auto make_sharp = [&](const Camera& image) -> std::unique_ptr<Renderer> {
    if (!area) return factory_.make(image, options_.colour, workers_);
    return factory_.make_with_area ? factory_.make_with_area(image, *area, workers_) : nullptr;
  };
  return with_point_spread(make_sharp, camera, options_.psf_px * camera.fx / model_.fx, sees_more_, workers_);
}

}  // namespace esim::inline compose

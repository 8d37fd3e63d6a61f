#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "esim/core/colour/colour.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/scene/splats/splat_objects.h"

namespace esim::inline backends::inline splats {

/// A renderer of surfaces among the splats.
struct SplatSurfaces {
  std::unique_ptr<Renderer> renderer{};
  std::vector<std::size_t> objects{};  ///< which of RenderRequest::objects its moving objects are
};

/// A scene of splats, prepared for the renderers of several cameras.
class SplatScene;

/// All objects must have the same SplatLight.
std::shared_ptr<const SplatScene> build_splat_scene(const std::vector<SplatObject>& objects);

/// Renders Gaussian splats on the processor. A pixel's colour is blended from front to back as in Kerbl et al., 3D
/// Gaussian Splatting for Real-Time Radiance Field Rendering, 2023, eq. (3), in the space of the splats' colours, and
/// then converted to linear light and to luminance, or to the colour that the pixel sees through its filter. Splats
/// fade out between opacities of 1.5/255 and 0.5/255, where the original cuts them off at 1/255, and next to the
/// camera: a cut would be a step in time.
///
/// Z is the depth of the splat at which half of the light is blocked: the mean depth of this Gaussian in the pixel. It
/// is infinite where less is blocked. V and objects are those of this splat.
///
/// The square over which a pixel averages is represented by SplatFilter: its variance is that of the sensor's pixel,
/// also in denser images, where `footprint` is above 1.
///
/// Surfaces hide the splats behind them. Their edges are blended in the space of the splats' colours.
std::unique_ptr<Renderer> make_splat_renderer(std::shared_ptr<const SplatScene> scene, const SplatOptions& options,
                                              const Camera& camera, const Workers& workers,
                                              ColourFilters filters = ColourFilters::none, double footprint = 1,
                                              SplatSurfaces surfaces = {});

}  // namespace esim::inline backends::inline splats

#pragma once

#include <memory>
#include <optional>

#include "esim/compose/compose.h"

// Private to compose.
namespace esim::inline compose {

/// Whether the pixels have colour filters.
inline bool sees_colour(const CameraOptions& camera) { return camera.colour != ColourFilters::none; }

/// Makes the renderers of a camera, with the area of its pixels and the blur of its lens.
class CameraRenderers {
 public:
  /// `sees_more`: renderers can see more than the image. All arguments must outlive it. Throws UserError for options
  /// that exclude each other.
  CameraRenderers(const RendererFactory& factory, const CameraOptions& options, const Camera& model, bool sees_more,
                  const Workers& workers);

  /// That of the image. Throws UserError if the renderer does not support the camera's options.
  std::unique_ptr<Renderer> make() const;

  /// That of a denser image of the same view; null if its pixels cannot average over `area`.
  std::unique_ptr<Renderer> make(const Camera& camera, const std::optional<PixelArea>& area) const;

 private:
  const RendererFactory& factory_;
  const CameraOptions& options_;
  const Camera& model_;
  bool sees_more_;
  const Workers& workers_;
};

}  // namespace esim::inline compose

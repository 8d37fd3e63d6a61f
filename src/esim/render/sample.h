#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/render/surface_point.h"

namespace esim::inline render {

/// One evaluation of the scene by one camera: a field per quantity, all of the image's size. Only the pixels in `tiles`
/// are valid.
struct Sample {
  TimeNs t = 0;             // of the evaluation               set by the renderer from the request
  std::vector<Tile> tiles;  // that were evaluated             set by the renderer from the request

  Image<float> irradiance;  // E, linear, 1.0 = white          computed by the renderer
  Image<float> depth;       // Z, planar, m; +inf: no surface  computed by the renderer
  Image<float> motion_x;    // V, px/s, to the right           by motion_field() from Z, object and the twists, and by
  Image<float> motion_y;    // V, px/s, downwards              the renderer if its scene deforms or is flat

  // The visible moving object: 0 for none, i + 1 for the i-th of the request, or of the sprites drawn on the sensor.
  // Computed by the renderer; empty unless the request wants_objects().
  Image<std::uint16_t> object;

  // The point that is visible, of objects that deform; arbitrary elsewhere. Computed by the renderer; empty unless
  // objects of its scene deform.
  Image<SurfacePoint> surface;

  /// Resizes to width x height pixels; keeps the content if that is already the size.
  void resize(int width, int height, bool with_objects = false, bool with_surfaces = false) {
    if (irradiance.width() != width || irradiance.height() != height) {
      for (Image<float>* field : {&irradiance, &depth, &motion_x, &motion_y}) *field = Image<float>(width, height);
    }
    const int object_width = with_objects ? width : 0, object_height = with_objects ? height : 0;
    if (object.width() != object_width || object.height() != object_height)
      object = Image<std::uint16_t>(object_width, object_height);
    const int surface_width = with_surfaces ? width : 0, surface_height = with_surfaces ? height : 0;
    if (surface.width() != surface_width || surface.height() != surface_height)
      surface = Image<SurfacePoint>(surface_width, surface_height);
  }
};

/// The irradiance of a tile's pixels between two of their samples, linear in log-irradiance unless a sensor states
/// otherwise. Segments of a tile are contiguous: t0 of each is t1 of the previous one. The first segment of a tile is
/// an instant (t0 == t1), which sets the reference of the pixels.
struct Segment {
  Tile tile;
  TimeNs t0 = 0, t1 = 0;
  ImageView<float> irradiance0;  ///< E at t0; borrowed, at least the tile's pixels
  ImageView<float> irradiance1;  ///< E at t1
};

/// Rows [first, last) of an image.
struct Rows {
  int first, last;
  int count() const { return last - first; }
};

}  // namespace esim::inline render

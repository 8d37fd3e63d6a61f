#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"

namespace esim {

/// One evaluation of the scene by one camera: a field per quantity, all of the image's size, of which only the
/// pixels of `tiles` are current.
struct Sample {
  TimeNs t = 0;             // of the evaluation            set by the renderer from the request
  std::vector<Tile> tiles;  // that were evaluated          set by the renderer from the request

  Image<float> irradiance;  // E, linear, 1.0 = white       computed by the renderer
  Image<float> depth;       // Z, planar, m; +inf: nothing  computed by the renderer
  Image<float> flow_x;      // V, px/s, to the right        by motion_field() from Z, object and the twists, or by the
  Image<float> flow_y;      // V, px/s, downwards           renderer where there is no space

  // E over the area of one pixel where the camera's footprint is wider, whose mean over the footprint is E. Has no size
  // elsewhere, and where edges do not matter: of panorama and plane.
  Image<float> narrow;

  // Which moving object is seen: 0 none, i + 1 the i-th of the request, or of the layers that are drawn on the sensor.
  // Computed by the renderer; has no size unless the request wants_objects().
  Image<std::uint16_t> object;

  /// Makes room for width x height pixels; keeps the content if the size is right already.
  void resize(int width, int height, bool with_objects = false) {
    if (irradiance.width() != width || irradiance.height() != height) {
      for (Image<float>* field : {&irradiance, &depth, &flow_x, &flow_y}) *field = Image<float>(width, height);
    }
    const int object_width = with_objects ? width : 0, object_height = with_objects ? height : 0;
    if (object.width() != object_width || object.height() != object_height)
      object = Image<std::uint16_t>(object_width, object_height);
  }
};

/// The irradiance of a tile's pixels between two of their samples, linear in log-irradiance unless a sensor says
/// otherwise. Contiguous segments of a tile follow each other: t0 of one is t1 of the one before. The first one of
/// a tile is an instant (t0 == t1): it sets the pixels' reference.
struct Segment {
  Tile tile;
  TimeNs t0 = 0, t1 = 0;
  ImageView<float> irradiance0;  ///< E at t0; borrowed, of the tile's pixels at least
  ImageView<float> irradiance1;  ///< E at t1
};

}  // namespace esim

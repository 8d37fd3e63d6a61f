#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/render/pixel_rays.h"

namespace esim::inline reproject {

/// Kind of the edge in a pixel, judged by depth.
enum class Edge : std::uint8_t {
  none,
  outline,  ///< boundary of a surface; the pixel sees the nearer side
  crease,   ///< bend of a surface
};

/// Points on the surfaces that an image sees, one array per quantity.
struct SurfacePoints {
  std::vector<float> x, y;              ///< bearing (x, y, 1)
  std::vector<float> nearness;          ///< 1 / Z, 1/m; 0 at infinity and if Z is invalid
  std::vector<float> slope_x, slope_y;  ///< change of nearness per pixel on a smooth surface; otherwise 0
  std::vector<std::uint16_t> part;      ///< as in SceneParts; empty if nothing moves
  std::vector<Edge> edge;               ///< edge that crosses the pixel

  int size() const { return static_cast<int>(x.size()); }
};

/// Finds the surfaces in an image from its depth.
class Surfaces {
 public:
  /// `focal_px`: horizontal focal length of the image.
  Surfaces(const Image<float>& depth, double focal_px, const Workers& workers);

  /// Nearness; within `reach` pixels of a nearer surface, that of the nearer one.
  Image<float> front(int reach) const;

  /// The edges that cross the pixels. Only the nearer surface's pixels have an outline: the farther surface has no edge
  /// there once the nearer one has moved away.
  Image<Edge> edges() const;

  /// Adds the point that pixel (x, y) sees along its ray; `part`: of SceneParts, by pixel.
  void add_point(const PixelRays& rays, const Image<std::uint16_t>& part, Edge edge, int x, int y,
                 SurfacePoints& to) const;

 private:
  float unlike(int x, int y, int reach) const;
  bool is_crease(int x, int y) const;
  template <typename Body>
  void for_each_pixel(const Body& body) const;

  const Workers& workers_;
  float bent_;
  Image<float> nearness_, slope_x_, slope_y_;
};

}  // namespace esim::inline reproject

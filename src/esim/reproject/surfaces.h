#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/render/pixel_rays.h"

namespace esim {

/// What depth shows of an edge in a pixel.
enum class Edge : std::uint8_t {
  none,
  outline,  ///< of a surface, of which the pixel sees the nearer side
  crease,   ///< of a surface
};

/// Points on the surfaces that an image sees, an array per quantity.
struct SurfacePoints {
  std::vector<float> x, y;              ///< bearing (x, y, 1)
  std::vector<float> nearness;          ///< 1 / Z, 1/m; 0 for what is infinitely far, and where Z is none
  std::vector<float> slope_x, slope_y;  ///< of nearness per pixel, on the smooth surface; 0 where there is none
  std::vector<std::uint16_t> object;    ///< 0: what stands still, i + 1: object i; empty where nothing moves
  std::vector<Edge> edge;               ///< that crosses the pixel

  int size() const { return static_cast<int>(x.size()); }
};

/// What an image's depth says about the surfaces in it.
class Surfaces {
 public:
  /// `focal_px`: the image's, horizontally.
  Surfaces(const Image<float>& depth, double focal_px, const Workers& workers);

  /// Nearness; beside a surface that is nearer and at most `reach` pixels away, that one's.
  Image<float> front(int reach) const;

  /// The edges that cross the pixels. Of an outline the nearer surface's pixels have it: those of the farther one see
  /// no edge once the nearer one has moved away.
  Image<Edge> edges() const;

  /// Adds what the pixel (x, y) sees, by the image's rays; `object` as in Sample.
  void add_point(const PixelRays& rays, const Image<std::uint16_t>& object, Edge edge, int x, int y,
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

}  // namespace esim

#pragma once

#include <cmath>

#include "esim/core/fast_arc_tangent.h"
#include "esim/geometry/camera.h"

namespace esim::inline reproject {

/// Maps a bearing (x, y, 1) to the distorted image point in single precision, for loops that compile to SIMD code: the
/// formulae of camera.h. Valid if |bearing| is at most that of a pixel of the camera.
template <typename Model>
class Lens;

template <>
class Lens<NoDistortion> {
 public:
  explicit Lens(const NoDistortion&) {}
  void operator()(float& /*x*/, float& /*y*/) const {}
};

template <>
class Lens<RadialTangential> {
 public:
  explicit Lens(const RadialTangential& m)
      : k1_(static_cast<float>(m.k1)),
        k2_(static_cast<float>(m.k2)),
        k3_(static_cast<float>(m.k3)),
        p1_(static_cast<float>(m.p1)),
        p2_(static_cast<float>(m.p2)) {}
  void operator()(float& x, float& y) const {
    const float r2 = x * x + y * y, xy2 = 2 * x * y;
    const float radial = 1 + r2 * (k1_ + r2 * (k2_ + r2 * k3_));
    const float u = x * radial + p1_ * xy2 + p2_ * (r2 + 2 * x * x);
    y = y * radial + p1_ * (r2 + 2 * y * y) + p2_ * xy2;
    x = u;
  }

 private:
  float k1_, k2_, k3_, p1_, p2_;
};

/// Arc tangent for t >= 0, within 3e-7.
inline float arc_tangent(float t) {
  const float angle = fast_arc_tangent(t > 1 ? 1 / t : t);
  return t > 1 ? 1.57079632679F - angle : angle;
}

template <>
class Lens<Equidistant> {
 public:
  explicit Lens(const Equidistant& m)
      : k1_(static_cast<float>(m.k1)),
        k2_(static_cast<float>(m.k2)),
        k3_(static_cast<float>(m.k3)),
        k4_(static_cast<float>(m.k4)) {}
  void operator()(float& x, float& y) const {
    const float r = std::sqrt(x * x + y * y + 1e-20F);
    const float theta = arc_tangent(r), t2 = theta * theta;
    const float scale = theta * (1 + t2 * (k1_ + t2 * (k2_ + t2 * (k3_ + t2 * k4_)))) / r;
    x *= scale;
    y *= scale;
  }

 private:
  float k1_, k2_, k3_, k4_;
};

template <>
class Lens<Fov> {
 public:
  explicit Lens(const Fov& m)
      : tangent_(static_cast<float>(2 * std::tan(m.w / 2))), inverse_w_(static_cast<float>(1 / m.w)) {}
  void operator()(float& x, float& y) const {
    const float r = std::sqrt(x * x + y * y + 1e-20F);
    const float scale = arc_tangent(r * tangent_) * inverse_w_ / r;
    x *= scale;
    y *= scale;
  }

 private:
  float tangent_, inverse_w_;
};

/// A camera's projection in single precision, of directions y (not normalised) in its frame.
template <typename Model>
struct Projector {
  Lens<Model> lens;
  float fx, fy, cx, cy, greatest_r2;

  Projector(const Camera& camera, const Model& model, double greatest_radius)
      : lens(model),
        fx(static_cast<float>(camera.fx)),
        fy(static_cast<float>(camera.fy)),
        cx(static_cast<float>(camera.cx)),
        cy(static_cast<float>(camera.cy)),
        greatest_r2(static_cast<float>(greatest_radius * greatest_radius)) {}

  /// The pixel coordinates; far outside the image if the direction is not projected.
  void operator()(float y0, float y1, float y2, float& u, float& v) const {
    const float inverse = 1.0F / y2;
    float x = y0 * inverse, y = y1 * inverse;
    const bool seen = y2 > 0 && x * x + y * y <= greatest_r2;
    x = seen ? x : 0.0F;
    y = seen ? y : 0.0F;
    lens(x, y);
    u = seen ? fx * x + cx : -1e6F;
    v = seen ? fy * y + cy : -1e6F;
  }
};

}  // namespace esim::inline reproject

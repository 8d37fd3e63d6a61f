#pragma once

#include "esim/backends/splats/lanes.h"
#include "esim/geometry/camera.h"

// The distortion models of geometry/camera.h for points side by side.
// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

struct LanePoints {
  Lanes x, y;
};

/// Arc tangent of t >= 0, within 3e-7: as core/fast_arc_tangent.h.
HWY_INLINE Lanes arc_tangent(Lanes t) {
  const auto far = hn::Gt(t, all(1));
  const Lanes r = hn::IfThenElse(far, hn::Div(all(1), hn::Max(t, all(1))), t), s = hn::Mul(r, r);
  Lanes angle = all(0.0028662257F);
  for (const float c : {-0.0161657367F, 0.0429096138F, -0.0752896400F, 0.1065626393F, -0.1420889944F, 0.1999355085F,
                        -0.3333314528F, 1.0F})
    angle = hn::MulAdd(angle, s, all(c));
  angle = hn::Mul(angle, r);
  return hn::IfThenElse(far, hn::Sub(all(1.57079632679F), angle), angle);
}

HWY_INLINE LanePoints distorted(const NoDistortion&, LanePoints ideal) { return ideal; }

HWY_INLINE LanePoints distorted(const RadialTangential& model, LanePoints ideal) {
  const auto set = [](double value) { return all(static_cast<float>(value)); };
  const Lanes x = ideal.x, y = ideal.y, xy = hn::Mul(x, y), r2 = hn::MulAdd(x, x, hn::Mul(y, y));
  const Lanes radial =
      hn::MulAdd(hn::MulAdd(hn::MulAdd(set(model.k3), r2, set(model.k2)), r2, set(model.k1)), r2, all(1));
  const auto along = [&](Lanes at, double with, double across) {
    const Lanes square = hn::MulAdd(hn::Mul(all(2), at), at, r2);
    return hn::MulAdd(at, radial, hn::MulAdd(set(2 * with), xy, hn::Mul(set(across), square)));
  };
  return {along(x, model.p1, model.p2), along(y, model.p2, model.p1)};
}

/// The radius in the image over that of the ideal point, for models with radial distortion only.
HWY_INLINE LanePoints scaled(LanePoints ideal, Lanes radius, Lanes image_radius, float at_centre) {
  const auto off_centre = hn::Gt(radius, all(1e-6F));
  const Lanes scale = hn::IfThenElse(off_centre, hn::Div(image_radius, hn::Max(radius, all(1e-6F))), all(at_centre));
  return {hn::Mul(ideal.x, scale), hn::Mul(ideal.y, scale)};
}

HWY_INLINE Lanes radius_of(LanePoints p) { return hn::Sqrt(hn::MulAdd(p.x, p.x, hn::Mul(p.y, p.y))); }

HWY_INLINE LanePoints distorted(const Equidistant& model, LanePoints ideal) {
  const auto set = [](double value) { return all(static_cast<float>(value)); };
  const Lanes r = radius_of(ideal), theta = arc_tangent(r), t2 = hn::Mul(theta, theta);
  Lanes p = set(model.k4);
  for (const double k : {model.k3, model.k2, model.k1, 1.0}) p = hn::MulAdd(p, t2, set(k));
  return scaled(ideal, r, hn::Mul(theta, p), 1);
}

HWY_INLINE LanePoints distorted(const Fov& model, LanePoints ideal) {
  const double slope = 2 * std::tan(model.w / 2);
  const Lanes r = radius_of(ideal);
  const Lanes image =
      hn::Mul(arc_tangent(hn::Mul(r, all(static_cast<float>(slope)))), all(static_cast<float>(1 / model.w)));
  return scaled(ideal, r, image, static_cast<float>(slope / model.w));
}

/// Moves points outside a disc onto its edge.
HWY_INLINE LanePoints inside(LanePoints ideal, float radius) {
  const Lanes r = radius_of(ideal);
  const Lanes scale = hn::Div(all(radius), hn::Max(r, all(radius)));
  return {hn::Mul(ideal.x, scale), hn::Mul(ideal.y, scale)};
}

}  // namespace esim::inline backends::inline splats

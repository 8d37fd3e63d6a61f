#pragma once

#include <memory>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/scene/images/texture.h"
#include "esim/scene/sprite.h"

namespace esim::inline backends::inline sprites {

/// An image that moves over the sensor.
struct Sprite {
  std::shared_ptr<const Texture> light;  ///< linear luminance times alpha; repeats if `beyond` does, clamps otherwise
  std::shared_ptr<const Texture> alpha;  ///< as `light`; null: opaque
  SpriteUnits units = SpriteUnits::pixel;
  SpriteBeyond beyond = SpriteBeyond::nothing;
  SpriteMotion motion;
  Eigen::Vector2d pivot{0.5, 0.5};  ///< the point of the image whose position `motion` gives, in (u, v)
};

/// Sprites drawn directly on the sensor, without a 3D camera.
struct SpriteScene {
  std::vector<Sprite> sprites;  ///< front to back
  float background = 0.2F;      ///< irradiance outside all sprites
};

/// Shows the scene on a sensor of the camera's size; pose, twist and lens have no effect. With c_i the fraction of the
/// pixel that sprite i covers, and P_i and a_i its light and alpha, averaged over the pixel's footprint:
///     E = sum_i T_i c_i P_i + T_end background,   T_i = product of (1 - c_j a_j) over the sprites j in front of i.
/// c_i is the area of the pixel inside the image's edges: exact if one edge crosses the pixel, and the product of two
/// such areas at a corner.
/// V is the velocity, at the pixel's centre, of the sprite with the largest T_i c_i a_i; it is zero if the weight of
/// the background is larger. Z is +inf: sprites have an order, but no distance.
std::unique_ptr<Renderer> make_sprites_renderer(SpriteScene scene, const Camera& camera, const Workers& workers);

}  // namespace esim::inline backends::inline sprites

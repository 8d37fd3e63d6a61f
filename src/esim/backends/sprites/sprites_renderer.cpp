#include "esim/backends/sprites/sprites_renderer.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "esim/render/bands.h"

namespace esim::inline backends::inline sprites {
namespace {

constexpr int kLanes = 16;
using Lanes = std::array<float, kLanes>;

/// The fraction of a pixel's footprint with one texture coordinate between 0 and 1. Over the pixel, the coordinate is
/// the sum of two uniform variables of widths |d/dx| and |d/dy|: its density is a trapezoid.
class EdgeCoverage {
 public:
  EdgeCoverage(double along_x, double along_y)
      : wide_(static_cast<float>(std::max(std::fabs(along_x), std::fabs(along_y)))),
        narrow_(static_cast<float>(std::min(std::fabs(along_x), std::fabs(along_y)))),
        per_wide_(1 / wide_),
        per_area_(0.5F * per_wide_ / std::max(narrow_, 1e-9F * wide_)) {}

  float operator()(float coordinate) const {
    return std::max(0.0F, fraction_inside(coordinate) + fraction_inside(1.0F - coordinate) - 1.0F);
  }

 private:
  /// The fraction inside an edge, for a pixel's centre at `distance` inside of it.
  float fraction_inside(float distance) const {
    const float depth = std::fabs(distance);
    const float tail = std::max(0.0F, 0.5F * (wide_ + narrow_) - depth);
    const float beyond = depth <= 0.5F * (wide_ - narrow_) ? 0.5F - depth * per_wide_ : tail * tail * per_area_;
    return distance > 0 ? 1.0F - beyond : beyond;
  }

  float wide_, narrow_, per_wide_, per_area_;
};

/// A coordinate that is reflected at each edge of the image.
inline float mirrored(float coordinate) {
  const float turn = coordinate - 2.0F * std::floor(0.5F * coordinate);
  return turn > 1.0F ? 2.0F - turn : turn;
}

/// A sprite on the sensor at one time.
struct PlacedSprite {
  const Sprite* sprite;
  std::uint16_t number;           // in the scene, from 1
  Eigen::Matrix2d uv_from_pixel;  // (u, v) = 1/2 + uv_from_pixel (pixel - centre)
  Eigen::Matrix2d flow_gradient;  // V = velocity + flow_gradient (pixel - centre)
  Eigen::Vector2d centre, velocity;
  EdgeCoverage coverage_u, coverage_v;
  Eigen::Vector2d reach;  // pixels further from the centre do not see it

  bool reaches(int first, int row) const {
    return std::fabs(row - centre.y()) <= reach.y() && first + kLanes - 1 >= centre.x() - reach.x() &&
           first <= centre.x() + reach.x();
  }
};

/// Empty if the sprite is degenerate: seen edge-on, or too small to be visible.
std::optional<PlacedSprite> place_on_sensor(const Sprite& sprite, std::uint16_t number, TimeNs t, PixelSize sensor) {
  constexpr double kMinArea_px2 = 1e-6;
  const SpritePlacement at =
      place(sprite.motion.at(t), sprite.units, {sprite.light->width(), sprite.light->height()}, sensor, sprite.pivot);
  if (!(std::fabs(at.A.determinant()) > kMinArea_px2)) return std::nullopt;
  const Eigen::Matrix2d inverse = at.A.inverse();

  // Half of the image's extent on the sensor, half a pixel, and a margin for rounding.
  Eigen::Vector2d reach = 0.5 * at.A.cwiseAbs().rowwise().sum() + Eigen::Vector2d::Constant(1.0);
  if (sprite.beyond != SpriteBeyond::nothing) reach.setConstant(std::numeric_limits<double>::infinity());
  return PlacedSprite{&sprite,
                      number,
                      inverse,
                      at.A_rate * inverse,
                      at.centre,
                      at.centre_velocity,
                      {inverse(0, 0), inverse(0, 1)},
                      {inverse(1, 0), inverse(1, 1)},
                      reach};
}

/// Some pixels of a row, onto which sprites are composited from front to back.
class Span {
 public:
  /// `which`: determine which sprite each pixel sees.
  Span(int first, int row, bool which) : first_(first), row_(row), which_(which) { transmittance_.fill(1.0F); }

  void lay_under(const PlacedSprite& placed);

  void lay_background(float irradiance) {
    for (unsigned i = 0; i < kLanes; ++i) {
      irradiance_[i] += transmittance_[i] * irradiance;
      if (transmittance_[i] <= weight_[i]) continue;
      flow_x_[i] = flow_y_[i] = 0.0F;
      number_[i] = 0;
    }
  }

  bool is_opaque() const {
    return std::all_of(transmittance_.begin(), transmittance_.end(), [](float left) { return left == 0.0F; });
  }

  void store(int count, Sample& sample) const {
    std::copy_n(irradiance_.begin(), count, sample.irradiance.row(row_) + first_);
    std::copy_n(flow_x_.begin(), count, sample.motion_x.row(row_) + first_);
    std::copy_n(flow_y_.begin(), count, sample.motion_y.row(row_) + first_);
    std::fill_n(sample.depth.row(row_) + first_, count, std::numeric_limits<float>::infinity());
    if (which_) std::copy_n(number_.begin(), count, sample.object.row(row_) + first_);
  }

 private:
  TextureLookup<kLanes> lookup(const PlacedSprite& placed) const;

  int first_, row_;
  bool which_;
  alignas(64) Lanes transmittance_{};  // of all sprites so far
  alignas(64) Lanes irradiance_{};
  alignas(64) Lanes weight_{};  // the largest contribution of a sprite to its pixel
  alignas(64) Lanes flow_x_{}, flow_y_{};
  std::array<std::uint16_t, kLanes> number_{};  // of the sprite with that contribution
};

TextureLookup<kLanes> Span::lookup(const PlacedSprite& placed) const {
  const Eigen::Matrix2f J = placed.uv_from_pixel.cast<float>();
  const Eigen::Vector2d pixel(0, row_);
  const Eigen::Vector2f origin =
      (Eigen::Vector2d::Constant(0.5) + placed.uv_from_pixel * (pixel - placed.centre)).cast<float>();
  TextureLookup<kLanes> at;
  at.du_dx.fill(J(0, 0)), at.du_dy.fill(J(0, 1));
  at.dv_dx.fill(J(1, 0)), at.dv_dy.fill(J(1, 1));
  const float u_x = J(0, 0), v_x = J(1, 0), u_0 = origin.x(), v_0 = origin.y();
  for (int i = 0; i < kLanes; ++i) {
    const auto lane = static_cast<unsigned>(i);
    const auto x = static_cast<float>(first_ + i);
    at.u[lane] = u_0 + u_x * x;
    at.v[lane] = v_0 + v_x * x;
  }
  return at;
}

void Span::lay_under(const PlacedSprite& placed) {
  const Sprite& sprite = *placed.sprite;
  TextureLookup<kLanes> at = lookup(placed);
  alignas(64) Lanes coverage;
  coverage.fill(1.0F);
  if (sprite.beyond == SpriteBeyond::nothing) {
    for (unsigned i = 0; i < kLanes; ++i) coverage[i] = placed.coverage_u(at.u[i]) * placed.coverage_v(at.v[i]);
  } else if (sprite.beyond == SpriteBeyond::mirror) {
    for (unsigned i = 0; i < kLanes; ++i) at.u[i] = mirrored(at.u[i]), at.v[i] = mirrored(at.v[i]);
  }
  const Lanes light = sprite.light->sample(at);
  Lanes alpha;
  alpha.fill(1.0F);
  if (sprite.alpha) alpha = sprite.alpha->sample(at);

  const Eigen::Matrix2f G = placed.flow_gradient.cast<float>();
  const Eigen::Vector2d pixel(0, row_);
  const Eigen::Vector2f origin = (placed.velocity + placed.flow_gradient * (pixel - placed.centre)).cast<float>();
  const float fx_x = G(0, 0), fy_x = G(1, 0), fx_0 = origin.x(), fy_0 = origin.y();
  const Lanes before = weight_;
  for (int i = 0; i < kLanes; ++i) {
    const auto lane = static_cast<unsigned>(i);
    const auto x = static_cast<float>(first_ + i);
    const float seen = transmittance_[lane] * coverage[lane], covers = coverage[lane] * alpha[lane];
    const float weight = seen * alpha[lane];
    irradiance_[lane] += seen * light[lane];
    flow_x_[lane] = weight > weight_[lane] ? fx_0 + fx_x * x : flow_x_[lane];
    flow_y_[lane] = weight > weight_[lane] ? fy_0 + fy_x * x : flow_y_[lane];
    weight_[lane] = std::max(weight, weight_[lane]);
    transmittance_[lane] *= std::max(0.0F, 1.0F - covers);
  }
  for (unsigned i = 0; which_ && i < kLanes; ++i) number_[i] = weight_[i] > before[i] ? placed.number : number_[i];
}

class SpritesRenderer final : public ProcessorRenderer {
 public:
  SpritesRenderer(SpriteScene scene, PixelSize sensor, const Workers& workers)
      : scene_(std::move(scene)), sensor_(sensor), workers_(workers) {}

  RendererTraits traits() const override {
    return {.name = "sprites", .granularity = Granularity::tile, .at_infinity = true, .on_sensor = true};
  }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    std::vector<std::vector<PlacedSprite>> placed;
    for (const RenderRequest& request : requests) {
      std::vector<PlacedSprite>& there = placed.emplace_back();
      std::uint16_t number = 0;
      for (const Sprite& sprite : scene_.sprites) {
        if (const auto here = place_on_sensor(sprite, ++number, request.t, sensor_)) there.push_back(*here);
      }
    }
    render_in_bands(requests, sensor_.width, sensor_.height, workers_, sample,
                    [&](std::size_t which, const Tile& band) {
                      for (int y = band.y; y < band.y + band.height; ++y) {
                        for (int x = band.x; x < band.x + band.width; x += kLanes) {
                          shade(placed[which], x, y, std::min(kLanes, band.x + band.width - x), sample);
                        }
                      }
                    });
  }

  void shade(const std::vector<PlacedSprite>& placed, int first, int row, int count, Sample& sample) const {
    Span span(first, row, !sample.object.empty());
    for (const PlacedSprite& sprite : placed) {
      if (!sprite.reaches(first, row)) continue;
      span.lay_under(sprite);
      if (span.is_opaque()) break;
    }
    span.lay_background(scene_.background);
    span.store(count, sample);
  }

  SpriteScene scene_;
  PixelSize sensor_;
  const Workers& workers_;
};

}  // namespace

std::unique_ptr<Renderer> make_sprites_renderer(SpriteScene scene, const Camera& camera, const Workers& workers) {
  return std::make_unique<SpritesRenderer>(std::move(scene), PixelSize{camera.width, camera.height}, workers);
}

}  // namespace esim::inline backends::inline sprites

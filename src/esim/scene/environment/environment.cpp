#include "esim/scene/environment/environment.h"

#include <fmt/format.h>

#include <bit>
#include <numbers>

#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/scene/images/image_file.h"

namespace esim::inline scene {
namespace {

constexpr int kSmallest = 64, kLargest = 1024;

/// Sizes of the maps for roughness 1/8, ... 1, of which a lobe covers at least several texels; and numbers of
/// directions in a lobe.
constexpr std::array<int, Environment::kLevels - 1> kSizes = {256, 128, 128, 64, 64, 64, 64, 64};
constexpr std::array<unsigned, Environment::kLevels - 1> kDirections = {256, 512, 512, 1024, 1024, 1024, 1024, 1024};

/// The radiance of all views, whose maps are computed together.
using Radiance = Eigen::Array4f;

/// Maps of half the size each, so that a mean over any solid angle is a single look-up.
class Pyramid {
 public:
  Pyramid(const OctahedralLayout& first, const Radiance* values) {
    OctahedralLayout layout{first.size, 0};
    values_.assign(values + first.offset, values + first.offset + first.value_count());
    layouts_.push_back(layout);
    while (layout.size > 1) {
      const OctahedralLayout finer = layout;
      layout = {finer.size / 2, values_.size()};
      values_.resize(values_.size() + layout.value_count());
      for (int row = 0; row < layout.size; ++row) {
        for (int column = 0; column < layout.size; ++column) {
          Radiance sum = Radiance::Zero();
          float weights = 0;
          for (int k = 0; k < 4; ++k) {
            const int x = 2 * column + k % 2, y = 2 * row + k / 2;
            const float weight = finer.centre(x, y).solid_angle_weight();
            sum += weight * finer.texel(values_.data(), x, y), weights += weight;
          }
          layout.texel(values_.data(), column, row) = sum / weights;
        }
      }
      layout.fold(values_.data());
      layouts_.push_back(layout);
    }
  }

  /// The value around a place; `level` 0 is the finest.
  Radiance value(const OctahedralPlace& at, float level) const {
    const float last = static_cast<float>(layouts_.size() - 1), clamped = std::min(std::max(level, 0.0F), last);
    const auto finer = static_cast<std::size_t>(std::min(clamped, last - 1));
    const Radiance a = layouts_[finer].value(values_.data(), at), b = layouts_[finer + 1].value(values_.data(), at);
    return a + (clamped - static_cast<float>(finer)) * (b - a);
  }

  /// The first map of at most a size.
  const OctahedralLayout& at_most(int size) const {
    std::size_t i = 0;
    while (layouts_[i].size > size) ++i;
    return layouts_[i];
  }
  const Radiance* values() const { return values_.data(); }
  int size() const { return layouts_[0].size; }

 private:
  std::vector<OctahedralLayout> layouts_;
  std::vector<Radiance> values_;
};

/// A frame of unit vectors whose third is `z` (Duff et al., "Building an orthonormal basis, revisited", JCGT 2017).
Eigen::Matrix3f frame_around(const Eigen::Vector3f& z) {
  const float sign = std::copysign(1.0F, z.z()), a = -1 / (sign + z.z()), b = z.x() * z.y() * a;
  Eigen::Matrix3f frame;
  frame.col(0) << 1 + sign * z.x() * z.x() * a, sign * b, -sign * z.x();
  frame.col(1) << b, sign + z.y() * z.y() * a, -z.y();
  frame.col(2) = z;
  return frame;
}

/// A direction of light in a lobe around z, and how it counts.
struct LobeSample {
  Eigen::Vector3f direction;
  float weight, level;  // of the pyramid
};

/// Directions of the GGX lobe that is seen along its axis, from half vectors at the points of a Hammersley set; each
/// stands for a solid angle (Křivánek, Colbert, "Real-time shading with filtered importance sampling", EGSR 2008).
std::vector<LobeSample> lobe(float roughness, unsigned count, int pyramid_size) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float alpha = roughness * roughness, alpha2 = alpha * alpha;
  const float texel = 4 * kPi / static_cast<float>(pyramid_size * pyramid_size);
  std::vector<LobeSample> samples;
  for (unsigned i = 0; i < count; ++i) {
    std::uint32_t bits = i;  // its bits in reverse order
    bits = (bits << 16) | (bits >> 16);
    bits = ((bits & 0x55555555U) << 1) | ((bits & 0xAAAAAAAAU) >> 1);
    bits = ((bits & 0x33333333U) << 2) | ((bits & 0xCCCCCCCCU) >> 2);
    bits = ((bits & 0x0F0F0F0FU) << 4) | ((bits & 0xF0F0F0F0U) >> 4);
    bits = ((bits & 0x00FF00FFU) << 8) | ((bits & 0xFF00FF00U) >> 8);
    const float azimuth = 2 * kPi * (static_cast<float>(bits >> 8) + 0.5F) / 16777216.0F;
    const float quantile = (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
    const float n_h2 = (1 - quantile) / (1 + (alpha2 - 1) * quantile), n_h = std::sqrt(n_h2);
    const float across = std::sqrt(std::max(1 - n_h2, 0.0F));
    const Eigen::Vector3f half(across * std::cos(azimuth), across * std::sin(azimuth), n_h);
    const Eigen::Vector3f direction = 2 * n_h * half - Eigen::Vector3f::UnitZ();
    if (!(direction.z() > 0)) continue;
    const float spread = n_h2 * (alpha2 - 1) + 1, density = alpha2 / (kPi * spread * spread) / 4;
    const float level = -0.5F * std::log2(static_cast<float>(count) * density * texel);
    samples.push_back({direction, direction.z(), level});
  }
  return samples;
}

template <class Function>
void fill(const OctahedralLayout& map, const Workers& workers, Radiance* values, const Function& value) {
  workers.for_each(map.size, [&](int row) {
    for (int column = 0; column < map.size; ++column) map.texel(values, column, row) = value(column, row);
  });
  map.fold(values);
}

Radiance filtered(const Pyramid& pyramid, const std::vector<LobeSample>& lobe, const Eigen::Vector3f& axis) {
  const Eigen::Matrix3f frame = frame_around(axis);
  Radiance sum = Radiance::Zero();
  float weights = 0;
  for (const LobeSample& sample : lobe) {
    const Eigen::Vector3f d = frame * sample.direction;
    sum += sample.weight * pyramid.value(OctahedralPlace::of(d.x(), d.y(), d.z()), sample.level);
    weights += sample.weight;
  }
  return sum / weights;
}

/// Means weighted by the cosine, by all texels of a small map.
class DiffuseLobe {
 public:
  explicit DiffuseLobe(const Pyramid& pyramid) {
    const OctahedralLayout& map = pyramid.at_most(kSmallest);
    for (int row = 0; row < map.size; ++row) {
      for (int column = 0; column < map.size; ++column) {
        const OctahedralPlace centre = map.centre(column, row);
        texels_.push_back({map.texel(pyramid.values(), column, row), centre.direction(), centre.solid_angle_weight()});
      }
    }
  }

  Radiance mean(const Eigen::Vector3f& normal) const {
    Radiance sum = Radiance::Zero();
    float weights = 0;
    for (const Texel& texel : texels_) {
      const float weight = texel.weight * std::max(texel.direction.dot(normal), 0.0F);
      sum += weight * texel.radiance, weights += weight;
    }
    return sum / weights;
  }

 private:
  struct Texel {
    Radiance radiance;
    Eigen::Vector3f direction;
    float weight;
  };
  std::vector<Texel> texels_;
};

/// Equirectangular images of the same size, turned around z.
class TurnedImages {
 public:
  TurnedImages(std::span<const Image<float>> views, double rotation_rad)
      : views_(views), rotation_(static_cast<float>(rotation_rad)) {}

  /// The mean at several places in a texel of a map.
  Radiance mean(const OctahedralLayout& map, int column, int row) const {
    const int side = std::clamp(2 * views_[0].height() / map.size, 2, 16);
    const float per = 1 / static_cast<float>(map.size * side);
    Radiance sum = Radiance::Zero();
    for (int k = 0; k < side * side; ++k) {
      const OctahedralPlace place{(static_cast<float>(column * side + k % side) + 0.5F) * per,
                                  (static_cast<float>(row * side + k / side) + 0.5F) * per};
      sum += bilinear(place.direction());
    }
    return sum / static_cast<float>(side * side);
  }

 private:
  Radiance bilinear(const Eigen::Vector3f& d) const {
    constexpr float kPi = std::numbers::pi_v<float>;
    const float longitude = std::atan2(d.y(), d.x()) - rotation_;
    const float latitude = std::atan2(d.z(), std::hypot(d.x(), d.y()));
    const float u = 0.5F - longitude / (2 * kPi), v = 0.5F - latitude / kPi;
    const int width = views_[0].width(), height = views_[0].height();
    const float x = (u - std::floor(u)) * static_cast<float>(width) - 0.5F;
    const float y = std::clamp(v * static_cast<float>(height) - 0.5F, 0.0F, static_cast<float>(height - 1));
    const int left = static_cast<int>(std::floor(x)), top = std::min(static_cast<int>(y), std::max(height - 2, 0));
    const float s = x - static_cast<float>(left), t = y - static_cast<float>(top);
    const int column0 = (left + width) % width, column1 = (left + 1) % width, bottom = std::min(top + 1, height - 1);
    Radiance values = Radiance::Zero();
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Image<float>& image = views_[i];
      values[static_cast<Eigen::Index>(i)] = (1 - t) * ((1 - s) * image(column0, top) + s * image(column1, top)) +
                                             t * ((1 - s) * image(column0, bottom) + s * image(column1, bottom));
    }
    return values;
  }

  std::span<const Image<float>> views_;
  float rotation_;
};

}  // namespace

Environment::Environment(const Planes& planes, float strength, double rotation_rad, const std::string& name)
    : rotation_rad_(rotation_rad) {
  const int height = planes[0].height(), largest = static_cast<int>(std::bit_ceil(static_cast<unsigned>(height)));
  std::size_t next = kDiffuse.value_count();
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    levels_[i] = {i == 0 ? std::clamp(largest, kSmallest, kLargest) : kSizes[i - 1], next};
    next += levels_[i].value_count();
  }
  view_size_ = next;
  std::vector<Image<float>> views;
  if (planes.size() == 3) {
    Image<float>& grey = views.emplace_back(planes[0].width(), height);
    for (std::size_t i = 0; i < grey.size(); ++i)
      grey.data()[i] = luminance(planes[0].data()[i], planes[1].data()[i], planes[2].data()[i]);
  }
  views.insert(views.end(), planes.begin(), planes.end());
  for (Image<float>& view : views) {
    for (float& value : view.pixels()) {
      value *= strength;
      if (!(value >= 0) || !std::isfinite(value))
        throw UserError(
            fmt::format("{}: its light must be finite and not negative, but it has a pixel of {}; repair "
                        "the image",
                        name, value));
    }
    skies_[view_count_++] = std::make_shared<const Texture>(view, Wrap::repeat, Wrap::clamp);
  }
  prefilter(views);
}

void Environment::prefilter(std::span<const Image<float>> views) {
  const Workers workers(0);
  std::vector<Radiance> maps(view_size_);
  const TurnedImages images(views, rotation_rad_);
  fill(levels_[0], workers, maps.data(), [&](int column, int row) { return images.mean(levels_[0], column, row); });
  const Pyramid pyramid(levels_[0], maps.data());
  const DiffuseLobe diffuse(pyramid);
  fill(kDiffuse, workers, maps.data(),
       [&](int column, int row) { return diffuse.mean(kDiffuse.centre(column, row).direction()); });
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    const std::vector<LobeSample> samples =
        lobe(static_cast<float>(i) / (kLevels - 1), kDirections[i - 1], pyramid.size());
    fill(levels_[i], workers, maps.data(),
         [&](int column, int row) { return filtered(pyramid, samples, levels_[i].centre(column, row).direction()); });
  }
  for (std::size_t view = 0; view < view_count_; ++view) {
    for (const Radiance& radiance : maps) values_.push_back(radiance[static_cast<Eigen::Index>(view)]);
  }
}

Planes load_environment_image(const std::filesystem::path& file, bool colour) {
  Planes planes;
  load_planes(file, Encoding::automatic, colour, planes);
  if (planes[0].width() != 2 * planes[0].height()) {
    throw UserError(fmt::format("environment {}: must be equirectangular, twice as wide as high, not {} x {} pixels",
                                file.string(), planes[0].width(), planes[0].height()));
  }
  return planes;
}

std::shared_ptr<const Environment> load_environment(const std::filesystem::path& file, float strength,
                                                    double rotation_rad, bool colour) {
  return std::make_shared<const Environment>(load_environment_image(file, colour), strength, rotation_rad,
                                             "environment " + file.string());
}

}  // namespace esim::inline scene

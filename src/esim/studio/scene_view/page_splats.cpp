#include "esim/studio/scene_view/page_splats.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "esim/scene/planes.h"

namespace esim::studio {
namespace {

constexpr float kWhite = 255;
constexpr std::size_t kSplatBytes = 32;
constexpr double kOutermost = 0.01;

/// Opacity times the area of the largest projection.
float visibility(const Splats& splats, std::size_t i) {
  return splats.opacities[i] * static_cast<float>(largest_area(splats.deviations[i].cast<double>()));
}

/// Chooses the splats whose visibility is above `least`, and the first `ties` whose visibility equals it.
struct Choice {
  float least = -1;
  std::size_t ties = 0;

  bool takes(float visibility) { return visibility > least || (visibility == least && ties > 0 && ties-- > 0); }
};

/// Chooses the `max` most visible splats of a scene.
Choice choice_of(const Scene& scene, std::size_t max) {
  std::vector<float> all;
  for (const SceneObject& object : scene.objects) {
    for (std::size_t i = 0; object.splats && i < object.splats->size(); ++i)
      all.push_back(visibility(*object.splats, i));
  }
  if (all.size() <= max) return {};
  const auto last = all.begin() + static_cast<std::ptrdiff_t>(max);
  std::nth_element(all.begin(), last, all.end(), std::greater<>());
  return {*last, max - static_cast<std::size_t>(std::count_if(all.begin(), last, [&](float v) { return v > *last; }))};
}

std::uint8_t byte_of(float value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.F, kWhite))); }

std::uint8_t display_colour(const Splats& splats, std::size_t i, std::size_t colour) {
  const float value = 0.5F + kHarmonic0 * splats.harmonics[i * splats.coefficients() * 3 + colour];
  const float shown = std::clamp(value, 0.F, 1.F);
  return byte_of(kWhite * (splats.light == SplatLight::linear ? srgb_from_linear(shown) : shown));
}

void append(const Splats& splats, std::size_t i, std::string& bytes) {
  struct {
    float position[3], deviation[3];
    std::uint8_t colour[4], rotation[4];  // of a .splat file (scene/splats/dot_splat.cpp)
  } packed;
  static_assert(sizeof packed == kSplatBytes);
  const Eigen::Quaternionf to_object = splats.to_object.cast<float>();
  const Eigen::Vector3f position = to_object * splats.positions[i];
  const Eigen::Quaternionf rotation = to_object * Eigen::Quaternionf(splats.rotations[i]);
  for (int k = 0; k < 3; ++k) {
    packed.position[k] = position[k];
    packed.deviation[k] = splats.deviations[i][k];
    packed.colour[k] = display_colour(splats, i, static_cast<std::size_t>(k));
    packed.rotation[k + 1] = byte_of(128 + 128 * rotation.vec()[k]);
  }
  packed.colour[3] = byte_of(kWhite * splats.opacities[i]);
  packed.rotation[0] = byte_of(128 + 128 * rotation.w());
  bytes.append(reinterpret_cast<const char*>(&packed), sizeof packed);
}

Eigen::AlignedBox3d middle_of(const Splats& splats) {
  Eigen::AlignedBox3d box;
  const Eigen::Matrix3f R = splats.to_object.toRotationMatrix().cast<float>();
  std::vector<float> along(splats.size());
  const auto outer = static_cast<std::ptrdiff_t>(kOutermost * static_cast<double>(splats.size()));
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < splats.size(); ++i) along[i] = R.row(axis).dot(splats.positions[i]);
    std::nth_element(along.begin(), along.begin() + outer, along.end());
    box.min()[axis] = along[static_cast<std::size_t>(outer)];
    std::nth_element(along.begin(), along.end() - 1 - outer, along.end());
    box.max()[axis] = *(along.end() - 1 - outer);
  }
  return box;
}

}  // namespace

std::vector<std::optional<PageSplats>> page_splats(const Scene& scene, std::size_t max) {
  Choice choice = choice_of(scene, max);
  std::vector<std::optional<PageSplats>> pages;
  for (const SceneObject& object : scene.objects) {
    std::optional<PageSplats>& page = pages.emplace_back();
    if (!object.splats) continue;
    const Splats& splats = *object.splats;
    page.emplace();
    page->bytes.reserve(kSplatBytes * std::min(max, splats.size()));
    for (std::size_t i = 0; i < splats.size(); ++i) {
      if (choice.takes(visibility(splats, i))) append(splats, i, page->bytes);
    }
    page->shown = page->bytes.size() / kSplatBytes;
    page->all = splats.size();
    page->filter = splats.filter;
    page->box = bounds(splats);
    page->middle = middle_of(splats);
  }
  return pages;
}

}  // namespace esim::studio

#include "esim/compose/scene_pictures.h"

#include <tuple>
#include <utility>

#include "esim/core/error.h"
#include "esim/scenario/read.h"

namespace esim::inline compose {
namespace {

bool same_rays(const Camera& a, const Camera& b) {
  const auto numbers = [](const Camera& c) { return std::tuple(c.width, c.height, c.fx, c.fy, c.cx, c.cy); };
  const auto coefficients = [](const Distortion& distortion) {
    struct ToList {
      std::vector<double> operator()(const NoDistortion&) const { return {}; }
      std::vector<double> operator()(const RadialTangential& d) const { return {d.k1, d.k2, d.p1, d.p2, d.k3}; }
      std::vector<double> operator()(const Equidistant& d) const { return {d.k1, d.k2, d.k3, d.k4}; }
      std::vector<double> operator()(const Fov& d) const { return {d.w}; }
    };
    return std::pair(distortion.index(), std::visit(ToList{}, distortion));
  };
  return numbers(a) == numbers(b) && coefficients(a.distortion) == coefficients(b.distortion);
}

}  // namespace

Camera scaled(const Camera& camera, int width, int height) {
  const double x = static_cast<double>(width) / camera.width, y = static_cast<double>(height) / camera.height;
  Camera result = camera;
  result.width = width, result.height = height;
  result.fx *= x, result.fy *= y;
  result.cx = (camera.cx + 0.5) * x - 0.5;
  result.cy = (camera.cy + 0.5) * y - 0.5;
  return result;
}

ScenePictures::ScenePictures(const Scenario& scenario, int threads, const Notices& notices) : workers_(threads) {
  const CameraOptions& options = scenario.cameras.front();
  const Camera camera = camera_model(options);
  for (const bool colour : {true, false}) {
    try {
      colour_ = colour;
      scene_ = load_scenes(scenario, colour ? SceneLook::colour : SceneLook::luminance, notices);
      play_deformations(scenario, 0, scene_);
      factory_ =
          build_renderer_factory(scenario.renderer, scene_, colour,
                                 {{options.name, camera, pose_named("T_body_camera", options.T_body_camera)}}, notices);
      traits_ = renderer_for(camera)->traits();
      return;
    } catch (const UserError&) {
      if (!colour) throw;
    }
  }
}

std::unique_ptr<Renderer> ScenePictures::renderer_for(const Camera& camera) const {
  return factory_.make(camera, colour_ ? ColourFilters::rggb : ColourFilters::none, workers_);
}

Image<Rgb> ScenePictures::render(const Camera& camera, int finer, RenderRequest view) {
  const Camera dense = scaled(camera, finer * camera.width, finer * camera.height);
  if (renderer_ == nullptr || !same_rays(dense, camera_)) {
    renderer_ = renderer_for(dense);
    camera_ = dense;
  }
  view.tiles = {{0, 0, dense.width, dense.height}};
  Sample sample;
  renderer_->render(std::move(view), sample);

  // The mean of the pixels of each colour, or of all pixels.
  PerColour<Image<float>> light;
  for (auto& channel : light) channel = Image<float>(camera.width, camera.height);
  const auto pixels = static_cast<float>(finer * finer);
  for (int y = 0; y < dense.height; ++y) {
    for (int x = 0; x < dense.width; ++x) {
      const float e = sample.irradiance(x, y);
      const std::size_t c = colour_at(x, y);
      for (std::size_t channel = 0; channel < light.size(); ++channel) {
        const float weight = colour_ ? (channel == c ? (c == 1 ? 2.0F : 4.0F) : 0.0F) : 1.0F;
        light[channel](x / finer, y / finer) += weight / pixels * e;
      }
    }
  }
  Image<Rgb> picture = grey(light[0]);
  const Image<Rgb> green = grey(light[1]), blue = grey(light[2]);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    picture.pixels()[i].g = green.pixels()[i].g;
    picture.pixels()[i].b = blue.pixels()[i].b;
  }
  return picture;
}

}  // namespace esim::inline compose

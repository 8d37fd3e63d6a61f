// The renderer of splats against slow double-precision code: accuracy, events and time. Usage:
//   measure_splats FILE [--inside] [--display|--linear] [--distance N] [--rate HZ]
// The camera looks along the file's z axis from N (2.5) times the scene's depth away or, with --inside, along its x
// axis, with z up, from its middle. Events are those of images at HZ (250), against those of slow code at 8 HZ.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "esim/backends/splats/splat_renderer.h"
#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/geometry/so3.h"
#include "esim/scene/splats/splat_file.h"
#include "render/splat_reference.h"

namespace esim {
namespace {

using Rules = test::SplatRules;

struct Setting {
  std::shared_ptr<Splats> splats;
  bool inside = false;
  double rate_hz = 250;
  SE3 start;  // of the camera in the scene
};

Setting set_up(int count, char** arguments) {
  Setting setting;
  if (count < 2)
    throw UserError("usage: measure_splats FILE [--inside] [--display|--linear] [--distance N] [--rate HZ]");
  setting.splats = std::make_shared<Splats>(
      load_splats(arguments[1], [](const std::string& warning) { fmt::print(stderr, "{}\n", warning); }));
  double distance = 2.5;
  for (int i = 2; i < count; ++i) {
    if (std::strcmp(arguments[i], "--distance") == 0 && i + 1 < count) distance = std::atof(arguments[i + 1]);
    if (std::strcmp(arguments[i], "--rate") == 0 && i + 1 < count) setting.rate_hz = std::atof(arguments[i + 1]);
    if (std::strcmp(arguments[i], "--inside") == 0) setting.inside = true;
    if (std::strcmp(arguments[i], "--linear") == 0) setting.splats->light = SplatLight::linear;
    if (std::strcmp(arguments[i], "--display") == 0) setting.splats->light = SplatLight::display;
  }
  fmt::print("{}: {}\n", arguments[1], summary(*setting.splats));
  const Eigen::AlignedBox3d box = bounds(*setting.splats);
  setting.start.translation = box.center();
  if (setting.inside) {
    Eigen::Matrix3d R;
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    setting.start.rotation = R;
  } else {
    setting.start.translation.z() -= distance * box.sizes().z();
  }
  return setting;
}

/// A camera that translates by 0.5 m/s and turns by about 13 deg/s, `t` seconds after the start.
Kinematics moved(const Setting& setting, double t) {
  Kinematics camera;
  camera.T_world_body.rotation = setting.start.rotation * so3_exp(Eigen::Vector3d(0.1, -0.2, 0.05) * t);
  camera.T_world_body.translation =
      setting.start.translation + setting.start.rotation * Eigen::Vector3d(0.45, 0, 0.2) * t;
  return camera;
}

std::unique_ptr<Renderer> make(const Setting& setting, const Camera& camera, const SplatOptions& options,
                               const Workers& workers) {
  return make_splat_renderer(build_splat_scene({{setting.splats}}), options, camera, workers);
}

double linear_of(const Splats& splats, double value) {
  if (splats.light == SplatLight::linear) return value;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

Image<float> luminance_of(const Splats& splats, const Image<test::SplatPixel>& pixels) {
  Image<float> image(pixels.width(), pixels.height());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d& colour = pixels.pixels()[i].colour;
    image.pixels()[i] =
        luminance(static_cast<float>(linear_of(splats, colour[0])), static_cast<float>(linear_of(splats, colour[1])),
                  static_cast<float>(linear_of(splats, colour[2])));
  }
  return image;
}

double psnr(const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(double{a.pixels()[i]} - double{b.pixels()[i]}, 2);
  return -10 * std::log10(sum / static_cast<double>(a.size()));
}

void compare_images(const Setting& setting, const Workers& workers) {
  const Camera camera = Camera::from_fov(346, 260, 1.0);
  fmt::print("\nPSNR, dB, of irradiance at 346 x 260:\n{:>6} {:>18} {:>18} {:>18} {:>18} {:>18}\n", "view",
             "depth, published", "unscented, publ.", "distance, its rule", "ray, its rule", "published, dist.");
  for (int view = 0; view < 3; ++view) {
    const Kinematics pose = moved(setting, view);
    const auto render = [&](SplatOrder order, SplatProjection projection) {
      SplatOptions options;
      options.order = order, options.projection = projection;
      Sample sample;
      make(setting, camera, options, workers)->render({0, pose, {{0, 0, 346, 260}}}, sample);
      return sample.irradiance;
    };
    const auto slow = [&](const Rules& rules) {
      return luminance_of(*setting.splats, test::render_slowly(*setting.splats, camera, pose.T_world_body, rules));
    };
    const Image<float> published = slow({Rules::Order::depth, false}), distance = slow({Rules::Order::distance, true}),
                       ray = slow({Rules::Order::ray, true});
    fmt::print("{:>6} {:>18.1f} {:>18.1f} {:>18.1f} {:>18.1f} {:>18.1f}\n", view,
               psnr(render(SplatOrder::depth, SplatProjection::linear), published),
               psnr(render(SplatOrder::depth, SplatProjection::unscented), published),
               psnr(render(SplatOrder::distance, SplatProjection::linear), distance),
               psnr(render(SplatOrder::ray, SplatProjection::linear), ray), psnr(published, distance));
  }
}

struct PixelEvent {
  double t;
  bool on;
};
using PixelEvents = std::vector<std::vector<PixelEvent>>;  ///< per pixel
using Brightness = std::vector<float>;                     ///< log irradiance of all pixels

/// The events of an ideal sensor that sees samples at an equal distance in time, linear in between.
PixelEvents events_of(const std::vector<Brightness>& samples, double interval_s, double threshold) {
  PixelEvents events(samples.front().size());
  for (std::size_t pixel = 0; pixel < events.size(); ++pixel) {
    double reference = double{samples[0][pixel]};
    for (std::size_t k = 1; k < samples.size(); ++k) {
      const double from = double{samples[k - 1][pixel]}, to = double{samples[k][pixel]};
      while (std::abs(to - reference) >= threshold) {
        const bool on = to > reference;
        reference += on ? threshold : -threshold;
        events[pixel].push_back({(static_cast<double>(k - 1) + (reference - from) / (to - from)) * interval_s, on});
      }
    }
  }
  return events;
}

/// The share of events that have a counterpart of the same pixel and polarity within 1 ms.
double matched(const PixelEvents& events, const PixelEvents& others) {
  std::size_t all = 0, found = 0;
  for (std::size_t pixel = 0; pixel < events.size(); ++pixel) {
    std::vector<bool> used(others[pixel].size());
    for (const PixelEvent& event : events[pixel]) {
      ++all;
      for (std::size_t k = 0; k < used.size(); ++k) {
        const PixelEvent& other = others[pixel][k];
        if (used[k] || other.on != event.on || std::abs(other.t - event.t) > 1e-3) continue;
        used[k] = true, ++found;
        break;
      }
    }
  }
  return static_cast<double>(found) / static_cast<double>(std::max<std::size_t>(all, 1));
}

/// The sum of all changes of all pixels: what an event camera responds to.
double variation(const std::vector<Brightness>& samples) {
  double sum = 0;
  for (std::size_t k = 1; k < samples.size(); ++k) {
    for (std::size_t pixel = 0; pixel < samples[k].size(); ++pixel)
      sum += std::abs(double{samples[k][pixel]} - double{samples[k - 1][pixel]});
  }
  return sum;
}

void compare_events(const Setting& setting, const Workers& workers) {
  constexpr int kSamples = 160, kDenser = 8, kWidth = 173, kHeight = 130;
  constexpr double kThreshold = 0.2;
  const double interval_s = 1 / (kDenser * setting.rate_hz);
  const Camera camera = Camera::from_fov(kWidth, kHeight, 1.0);
  const auto brightness = [](const Image<float>& irradiance) {
    Brightness values;
    for (const float light : irradiance.pixels()) values.push_back(std::log(light + 1e-3F));
    return values;
  };
  const auto render_all_slowly = [&](Rules::Order order) {
    std::vector<Brightness> samples(kSamples + 1);
    workers.for_each(kSamples + 1, [&](int i) {
      const SE3 pose = moved(setting, i * interval_s).T_world_body;
      samples[static_cast<std::size_t>(i)] =
          brightness(luminance_of(*setting.splats, test::render_slowly(*setting.splats, camera, pose, {order, true})));
    });
    return samples;
  };
  const std::vector<Brightness> slow = render_all_slowly(Rules::Order::distance),
                                by_ray = render_all_slowly(Rules::Order::ray);
  const auto events_in = [&](SplatOrder order, int denser) {
    SplatOptions options;
    options.order = order;
    const auto renderer = make(setting, camera, options, workers);
    std::vector<Brightness> fast;
    for (int i = 0; i <= kSamples; i += denser) {
      Sample sample;
      renderer->render({0, moved(setting, i * interval_s), {{0, 0, kWidth, kHeight}}}, sample);
      fast.push_back(brightness(sample.irradiance));
    }
    return events_of(fast, interval_s * denser, kThreshold);
  };
  fmt::print(
      "\nevents at {} x {}, C = {}, sampled at {:g} Hz, against slow code at {:g} Hz: which share is matched, and "
      "which "
      "share of the true ones is found, %\n",
      kWidth, kHeight, kThreshold, 1 / (interval_s * kDenser), 1 / interval_s);
  const PixelEvents expected = events_of(slow, interval_s, kThreshold),
                    expected_by_ray = events_of(by_ray, interval_s, kThreshold);
  const auto compare = [](const char* what, const PixelEvents& found, const PixelEvents& truth) {
    fmt::print("{}: {:.2f}, {:.2f}\n", what, 100 * matched(found, truth), 100 * matched(truth, found));
  };
  const PixelEvents found = events_in(SplatOrder::distance, kDenser);
  compare("order: distance, against the same order", found, expected);
  compare("order: distance, against the order by rays", found, expected_by_ray);
  compare("order: ray, against the same order", events_in(SplatOrder::ray, kDenser), expected_by_ray);
  compare("order: ray, sampled as often", events_in(SplatOrder::ray, 1), expected_by_ray);
  fmt::print("total variation of log E in the slow code: {:.0f} by distance, {:.0f} by the mean depth in each pixel\n",
             variation(slow), variation(by_ray));
}

void measure_time(const Setting& setting, SplatOrder order) {
  const Camera camera = Camera::from_fov(346, 260, 1.0);
  fmt::print("\ntime per image at 346 x 260 by {}, and per tile of 16 x 16 in its middle, ms:\n",
             order == SplatOrder::ray ? "rays" : "distance");
  SplatOptions options;
  options.order = order;
  for (const int threads : {1, 2}) {
    const Workers workers(threads);
    const auto renderer = make(setting, camera, options, workers);
    const auto time_of = [&](const Tile& tile, int repetitions) {
      Sample sample;
      renderer->render({0, moved(setting, 0), {tile}}, sample);
      const auto start = std::chrono::steady_clock::now();
      for (int i = 0; i < repetitions; ++i) renderer->render({0, moved(setting, i * 1e-3), {tile}}, sample);
      return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count() / repetitions;
    };
    const double image = time_of({0, 0, 346, 260}, 50), tile = time_of({160, 128, 16, 16}, 500);
    fmt::print("{} threads: {:.2f}, {:.3f} ({:.4f} of the image, whose share is {:.4f})\n", threads, image, tile,
               tile / image, 256.0 / (346 * 260));
  }
}

int run(int count, char** arguments) {
  const Setting setting = set_up(count, arguments);
  const Workers workers(0);
  measure_time(setting, SplatOrder::distance);
  measure_time(setting, SplatOrder::ray);
  compare_images(setting, workers);
  compare_events(setting, workers);
  return 0;
}

}  // namespace
}  // namespace esim

int main(int count, char** arguments) {
  try {
    return esim::run(count, arguments);
  } catch (const esim::Error& error) {
    fmt::print(stderr, "measure_splats: {}\n", error.what());
    return 1;
  }
}

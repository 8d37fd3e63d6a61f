#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"
#include "esim/geometry/se3.h"
#include "esim/scene/splats/splats.h"

namespace esim::test {

/// The rules of Gaussian splatting that differ between programs.
struct SplatRules {
  enum class Order {
    distance,  ///< of the centres
    depth,     ///< of the centres
    ray,  ///< of the splat on the ray of each pixel: its inverse depth, and 1/1024 of the centre's inverse distance
  };
  Order order = Order::ray;
  bool fades = true;  ///< splats fade out between opacities of 1.5/255 and 0.5/255; otherwise they end at 1/255
};

struct SplatPixel {
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  double transmittance = 1, depth = std::numeric_limits<double>::infinity();
};

/// Real spherical harmonics in the order and with the signs of 3D Gaussian splatting.
inline std::array<double, 16> harmonics_along(const Eigen::Vector3d& d) {
  const double x = d.x(), y = d.y(), z = d.z();
  return {0.28209479177387814,
          -0.4886025119029199 * y,
          0.4886025119029199 * z,
          -0.4886025119029199 * x,
          1.0925484305920792 * x * y,
          -1.0925484305920792 * y * z,
          0.31539156525252005 * (2 * z * z - x * x - y * y),
          -1.0925484305920792 * x * z,
          0.5462742152960396 * (x * x - y * y),
          -0.5900435899266435 * y * (3 * x * x - y * y),
          2.890611442640554 * x * y * z,
          -0.4570457994644658 * y * (4 * z * z - x * x - y * y),
          0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y),
          -0.4570457994644658 * x * (4 * z * z - x * x - y * y),
          1.445305721320277 * z * (x * x - y * y),
          -0.5900435899266435 * x * (x * x - 3 * y * y)};
}

inline Eigen::Vector3d splat_colour(const Splats& splats, std::size_t i, const Eigen::Vector3d& direction) {
  const std::array<double, 16> basis = harmonics_along(direction);
  Eigen::Vector3d colour(0.5, 0.5, 0.5);
  for (std::size_t k = 0; k < splats.coefficients(); ++k) {
    for (int c = 0; c < 3; ++c)
      colour[c] += basis[k] * static_cast<double>(
                                  splats.harmonics[(i * splats.coefficients() + k) * 3 + static_cast<std::size_t>(c)]);
  }
  return colour.cwiseMax(0.0);
}

/// Renders splats with the published equations (Kerbl et al., 2023; Zwicker et al., EWA Splatting, 2002) in plain
/// double-precision code, through a camera without distortion.
inline Image<SplatPixel> render_slowly(const Splats& splats, const Camera& camera, const SE3& T_world_camera,
                                       const SplatRules& rules) {
  struct Contribution {
    double order, depth, opacity;
    std::uint32_t splat;
  };
  std::vector<std::vector<Contribution>> pixels(static_cast<std::size_t>(camera.width * camera.height));
  std::vector<Eigen::Vector3d> colours(splats.size());
  const SE3 T_camera_splats = T_world_camera.inverse() * SE3{splats.to_object, Eigen::Vector3d::Zero()};
  const Eigen::Matrix3d R = T_camera_splats.rotation.toRotationMatrix();
  const Eigen::Vector3d eye = T_camera_splats.inverse().translation;
  const double limit_x = 1.3 * std::max(camera.cx, camera.width - 1 - camera.cx) / camera.fx;
  const double limit_y = 1.3 * std::max(camera.cy, camera.height - 1 - camera.cy) / camera.fy;
  const double variance = splats.filter == SplatFilter::mip ? 0.1 : 0.3;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const Eigen::Vector3d position = splats.positions[i].cast<double>(), mean = R * (position - eye);
    if (mean.z() <= 0.01) continue;
    const Eigen::Vector4f& q = splats.rotations[i];
    const Eigen::Matrix3d axes =
        R * Eigen::Quaternionf(q[3], q[0], q[1], q[2]).cast<double>().normalized().toRotationMatrix();
    const Eigen::Vector3d deviations = splats.deviations[i].cast<double>();
    const Eigen::Matrix3d covariance = axes * deviations.array().square().matrix().asDiagonal() * axes.transpose();

    const double x = mean.x() / mean.z(), y = mean.y() / mean.z();
    Eigen::Matrix<double, 2, 3> J;
    J << camera.fx, 0, -camera.fx * std::clamp(x, -limit_x, limit_x), 0, camera.fy,
        -camera.fy * std::clamp(y, -limit_y, limit_y);
    J /= mean.z();
    const Eigen::Matrix2d own = J * covariance * J.transpose(), wide = own + variance * Eigen::Matrix2d::Identity();
    double opacity = static_cast<double>(splats.opacities[i]) * std::min(1.0, mean.z() / 0.01 - 1);
    if (splats.filter != SplatFilter::dilated)
      opacity *= std::sqrt(std::max(0.0, own.determinant()) / wide.determinant());
    const Eigen::Matrix2d conic = wide.inverse();
    // The mean depth of the Gaussian, widened in the image, at a pixel: cov(depth, pixel) cov(pixel)^-1
    const Eigen::Vector2d slope = conic * (J * covariance.col(2));
    const Eigen::Vector2d centre(camera.fx * x + camera.cx, camera.fy * y + camera.cy);
    const Eigen::Vector2d reach = 3.6 * wide.diagonal().cwiseSqrt();
    const auto limited = [](double value, int size) { return static_cast<int>(std::clamp(value, -1.0, size + 1.0)); };
    colours[i] = splat_colour(splats, i, (position - eye).normalized());
    const double thickness = 3 * std::sqrt(covariance(2, 2));
    for (int v = std::max(0, limited(centre.y() - reach.y(), camera.height));
         v <= std::min(camera.height - 1, limited(centre.y() + reach.y(), camera.height)); ++v) {
      for (int u = std::max(0, limited(centre.x() - reach.x(), camera.width));
           u <= std::min(camera.width - 1, limited(centre.x() + reach.x(), camera.width)); ++u) {
        const Eigen::Vector2d d = Eigen::Vector2d(u, v) - centre;
        double alpha = opacity * std::exp(-0.5 * d.dot(conic * d));
        if (rules.fades) {
          alpha *= std::clamp((alpha - 0.5 / 255) / (1.0 / 255), 0.0, 1.0);
        } else if (alpha < 1.0 / 255) {
          alpha = 0;
        }
        if (alpha <= 0) continue;
        const double depth = std::clamp(1 / std::max(1e-9, 1 / mean.z() - slope.dot(d) / (mean.z() * mean.z())),
                                        std::max(mean.z() - thickness, 0.05 * mean.z()), mean.z() + thickness);
        const double order = rules.order == SplatRules::Order::ray     ? 1 / (1 / depth + 1 / (1024 * mean.norm()))
                             : rules.order == SplatRules::Order::depth ? mean.z()
                                                                       : mean.norm();
        pixels[static_cast<std::size_t>(v * camera.width + u)].push_back(
            {order, depth, std::min(alpha, 0.99), static_cast<std::uint32_t>(i)});
      }
    }
  }
  Image<SplatPixel> image(camera.width, camera.height);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      auto& contributions = pixels[static_cast<std::size_t>(v * camera.width + u)];
      std::stable_sort(contributions.begin(), contributions.end(),
                       [](const Contribution& a, const Contribution& b) { return a.order < b.order; });
      SplatPixel& pixel = image(u, v);
      for (const Contribution& contribution : contributions) {
        if (pixel.transmittance < 1e-4) break;
        const double before = pixel.transmittance;
        pixel.colour += before * contribution.opacity * colours[contribution.splat];
        pixel.transmittance *= 1 - contribution.opacity;
        if (before >= 0.5 && pixel.transmittance < 0.5) pixel.depth = contribution.depth;
      }
    }
  }
  return image;
}

}  // namespace esim::test

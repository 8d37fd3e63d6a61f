#include "esim/render/pixel_rays.h"

#include <Eigen/LU>
#include <string>

#include "esim/core/error.h"

namespace esim {

PixelRays::PixelRays(const Camera& camera) {
  for (Image<float>* table : {&x, &y, &du_dx, &du_dy, &dv_dx, &dv_dy, &dx_du, &dx_dv, &dy_du, &dy_dv}) {
    *table = Image<float>(camera.width, camera.height);
  }
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.back_project({u, v});
      if (!ray) {
        throw UserError("camera: the distortion cannot be inverted at pixel (" + std::to_string(u) + ", " +
                        std::to_string(v) + "); check its coefficients or make the image smaller");
      }
      x(u, v) = static_cast<float>(ray->bearing.x());
      y(u, v) = static_cast<float>(ray->bearing.y());

      const Eigen::Matrix2d bearing_from_pixel = ray->jacobian.topRows<2>();
      dx_du(u, v) = static_cast<float>(bearing_from_pixel(0, 0));
      dx_dv(u, v) = static_cast<float>(bearing_from_pixel(0, 1));
      dy_du(u, v) = static_cast<float>(bearing_from_pixel(1, 0));
      dy_dv(u, v) = static_cast<float>(bearing_from_pixel(1, 1));

      const Eigen::Matrix2d pixel_from_bearing = bearing_from_pixel.inverse();
      du_dx(u, v) = static_cast<float>(pixel_from_bearing(0, 0));
      du_dy(u, v) = static_cast<float>(pixel_from_bearing(0, 1));
      dv_dx(u, v) = static_cast<float>(pixel_from_bearing(1, 0));
      dv_dy(u, v) = static_cast<float>(pixel_from_bearing(1, 1));
    }
  }
}

}  // namespace esim

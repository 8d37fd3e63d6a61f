#include "esim/render/pixel_rays.h"

#include <Eigen/LU>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline render {

PixelTable::PixelTable(Image<float> values) : width_(values.width()), height_(values.height()) {
  const auto width = static_cast<std::size_t>(width_);
  one_row_ = height_ > 1;
  for (int y = 1; y < height_ && one_row_; ++y)
    one_row_ = std::memcmp(values.row(y), values.row(0), width * sizeof(float)) == 0;
  if (one_row_) {
    values_ = Image<float>(width_, 1);
    std::copy_n(values.row(0), width, values_.row(0));
  } else {
    values_ = std::move(values);
  }
}

PixelRays::PixelRays(const Camera& camera, double footprint) {
  std::array<Image<float>, 10> values;
  for (Image<float>& image : values) image = Image<float>(camera.width, camera.height);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.back_project({u, v});
      if (!ray) {
        throw UserError("camera: the distortion cannot be inverted at pixel (" + std::to_string(u) + ", " +
                        std::to_string(v) + "); check its coefficients or make the image smaller");
      }
      const Eigen::Matrix2d bearing_from_pixel = ray->jacobian.topRows<2>();
      const Eigen::Matrix2d area = footprint * bearing_from_pixel;
      const Eigen::Matrix2d pixel_from_bearing = bearing_from_pixel.inverse();
      const double row[] = {ray->bearing.x(),
                            ray->bearing.y(),
                            pixel_from_bearing(0, 0),
                            pixel_from_bearing(0, 1),
                            pixel_from_bearing(1, 0),
                            pixel_from_bearing(1, 1),
                            area(0, 0),
                            area(0, 1),
                            area(1, 0),
                            area(1, 1)};
      for (std::size_t i = 0; i < values.size(); ++i) values[i](u, v) = static_cast<float>(row[i]);
    }
  }
  PixelTable* const tables[] = {&x, &y, &du_dx, &du_dy, &dv_dx, &dv_dy, &dx_du, &dx_dv, &dy_du, &dy_dv};
  for (std::size_t i = 0; i < values.size(); ++i) *tables[i] = PixelTable(std::move(values[i]));
}

}  // namespace esim::inline render

#include "figure.h"

#include <esim/files/output_file.h>
#include <esim/plot/axes.h>
#include <esim/preview/pictures.h>

#include <algorithm>
#include <utility>

void draw(const Flight& flight, const std::filesystem::path& file) {
  constexpr esim::Rgb kCommanded{200, 200, 200}, kFlown{32, 96, 176}, kEstimated{214, 110, 30};
  constexpr int kWidth = 900, kHeight = 560;
  double low_x = -2.5, high_x = 2.5, low_y = -1.5, high_y = 1.5;
  for (const Eigen::Vector3d& p : flight.flown) {
    low_x = std::min(low_x, p.x()), high_x = std::max(high_x, p.x());
    low_y = std::min(low_y, p.y()), high_y = std::max(high_y, p.y());
  }
  using esim::Mark;
  esim::Canvas canvas(kWidth, kHeight, esim::kLightTheme.page);
  esim::Axes axes(
      canvas, canvas.pixels().bounds(), esim::linear_scale(low_x, high_x, "x (m)"),
      esim::linear_scale(low_y, high_y, "y (m)"),
      {"A quadrotor flown by its simulated IMU, seen from above",
       {{"commanded", kCommanded, Mark::line}, {"flown", kFlown, Mark::line}, {"estimated", kEstimated, Mark::line}}});
  const auto path = [&](const std::vector<Eigen::Vector3d>& points, esim::Rgb colour, double width) {
    std::vector<esim::DataPoint> line;
    for (const Eigen::Vector3d& p : points) line.push_back({p.x(), p.y()});
    axes.line(line, colour, width);
  };
  path(flight.commanded, kCommanded, 7);
  path(flight.flown, kFlown, 2.5);
  path(flight.estimated, kEstimated, 1);
  axes.finish();
  esim::write_file_atomically(file, esim::encode_png(std::move(canvas).take()));
}

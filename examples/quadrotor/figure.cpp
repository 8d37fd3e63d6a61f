#include "figure.h"

#include <esim/files/output_file.h>
#include <esim/stats/axes.h>

#include <algorithm>
#include <string>
#include <utility>

void draw(const Flight& flight, const std::filesystem::path& file) {
  constexpr esim::Rgb kCommanded{200, 200, 200}, kFlown{32, 96, 176}, kEstimated{214, 110, 30};
  constexpr int kWidth = 900, kHeight = 560;
  double low_x = -2.5, high_x = 2.5, low_y = -1.5, high_y = 1.5;
  for (const Eigen::Vector3d& p : flight.flown) {
    low_x = std::min(low_x, p.x()), high_x = std::max(high_x, p.x());
    low_y = std::min(low_y, p.y()), high_y = std::max(high_y, p.y());
  }
  esim::Canvas canvas(kWidth, kHeight, esim::kPaper);
  esim::Axes axes(canvas, {70, 50, 800, 440}, "A quadrotor flown by its simulated IMU, seen from above",
                  esim::linear_scale(low_x, high_x, "x, m"), esim::linear_scale(low_y, high_y, "y, m"));
  int key = 80;
  const auto path = [&](const std::vector<Eigen::Vector3d>& points, const std::string& name, esim::Rgb colour,
                        double width) {
    std::vector<esim::DataPoint> line;
    for (const Eigen::Vector3d& p : points) line.push_back({p.x(), p.y()});
    axes.line(line, colour, width);
    const esim::Spot ends[] = {{key + 0.0, 72}, {key + 24.0, 72}};
    canvas.polyline(ends, width, colour);
    key += 32 + canvas.text(key + 32, 77, name, 9, esim::kInk) + 30;
  };
  path(flight.commanded, "commanded", kCommanded, 7);
  path(flight.flown, "flown", kFlown, 2.5);
  path(flight.estimated, "estimated", kEstimated, 1);
  axes.finish();
  esim::write_file_atomically(file, esim::encode_png(std::move(canvas).take()));
}

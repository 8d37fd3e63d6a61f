#include "esim/fit/circuit/count_moments.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "esim/fit/background_fit.h"
#include "esim/fit/jackknife.h"

namespace esim::inline fit {
namespace {

Eigen::Index statistics_of(const std::vector<PixelCounts>& recordings) {
  Eigen::Index count = 0;
  for (const PixelCounts& r : recordings) count += r.light.flickers() ? 2 : 1;
  return count;
}

/// The rates of a pixel.
void rates_of(const std::vector<PixelCounts>& recordings, std::size_t pixel, Eigen::VectorXd& rates) {
  Eigen::Index k = 0;
  for (const PixelCounts& r : recordings) {
    const PixelCounts::Pixel& counts = r.pixels.pixels()[pixel];
    if (r.light.flickers()) rates[k++] = counts.on / r.extent;
    rates[k++] = counts.off / r.extent;
  }
}

/// Takes the logarithm of the rates in constant light, of at least half an event of all pixels. Returns the
/// derivatives.
Eigen::VectorXd take_logarithms(const std::vector<PixelCounts>& recordings, double pixels, Eigen::VectorXd& rates) {
  Eigen::VectorXd slopes = Eigen::VectorXd::Ones(rates.size());
  Eigen::Index k = 0;
  for (const PixelCounts& r : recordings) {
    if (r.light.flickers()) {
      k += 2;
      continue;
    }
    const double rate = std::max(rates[k], 0.5 / (r.extent * pixels));
    slopes[k] = 1 / rate;
    rates[k++] = std::log(rate);
  }
  return slopes;
}

}  // namespace

std::vector<bool> usable_pixels(const std::vector<PixelCounts>& recordings) {
  const std::size_t count = recordings.front().pixels.size();
  std::vector<bool> usable(count, true), lit(count, false);
  bool lamps = false;
  for (const PixelCounts& r : recordings) {
    std::vector<double> events;
    for (const PixelCounts::Pixel& p : r.pixels.pixels()) events.push_back(static_cast<double>(p.on) + p.off);
    const double limit = hot_pixel_limit(events);
    lamps = lamps || r.light.flickers();
    for (std::size_t i = 0; i < count; ++i) {
      if (events[i] > limit) usable[i] = false;
      if (r.light.flickers() && events[i] > 0) lit[i] = true;
    }
  }
  if (lamps) std::transform(usable.begin(), usable.end(), lit.begin(), usable.begin(), std::logical_and<>());
  return usable;
}

CountMoments count_moments(const std::vector<PixelCounts>& recordings, const std::vector<bool>& usable) {
  const Eigen::Index n = statistics_of(recordings);
  Eigen::VectorXd rates(n), sum = Eigen::VectorXd::Zero(n);
  CountMoments result;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    if (!usable[i]) continue;
    rates_of(recordings, i, rates);
    sum += rates;
    result.pixels += 1;
  }
  const Eigen::VectorXd mean = sum / result.pixels;
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < usable.size(); ++i) {
    if (!usable[i]) continue;
    rates_of(recordings, i, rates);
    products.noalias() += (rates - mean) * (rates - mean).transpose();
  }
  result.mean = mean;
  const Eigen::VectorXd slopes = take_logarithms(recordings, result.pixels, result.mean);
  result.covariance =
      slopes.asDiagonal() * products * slopes.asDiagonal() / (result.pixels * std::max(1.0, result.pixels - 1));
  return result;
}

std::vector<Eigen::VectorXd> means_without_areas(const std::vector<PixelCounts>& recordings,
                                                 const std::vector<bool>& usable) {
  const Image<PixelCounts::Pixel>& image = recordings.front().pixels;
  const AreaGrid grid(image.width(), image.height());
  const Eigen::Index n = statistics_of(recordings);
  Eigen::VectorXd rates(n), all = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::VectorXd> sums(grid.areas(), Eigen::VectorXd::Zero(n));
  std::vector<double> pixels(grid.areas(), 0);
  double count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(x);
      if (!usable[i]) continue;
      rates_of(recordings, i, rates);
      sums[grid.of(x, y)] += rates, all += rates;
      pixels[grid.of(x, y)] += 1, count += 1;
    }
  }
  std::vector<Eigen::VectorXd> result;
  for (std::size_t area = 0; area < sums.size(); ++area) {
    if (pixels[area] == 0 || pixels[area] == count) continue;
    Eigen::VectorXd mean = (all - sums[area]) / (count - pixels[area]);
    take_logarithms(recordings, count - pixels[area], mean);
    result.push_back(std::move(mean));
  }
  return result;
}

}  // namespace esim::inline fit

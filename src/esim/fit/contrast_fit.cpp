#include "esim/fit/contrast_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "esim/core/error.h"
#include "esim/fit/jackknife.h"
#include "esim/stats/numerics/median.h"

namespace esim::inline fit {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kExplained = 0.5;  // fraction of the variance of L below which nothing is determined
constexpr TimeNs kImagesPerEvent = 2;
constexpr double kShort = 3;                 // refractory periods: events nearer to each other miss too much
constexpr double kTypicalThreshold = 0.25;   // ln
constexpr double kTypicalSpread = 0.05;      // of thresholds from pixel to pixel, for weights
constexpr double kPoor = 0.25;               // relative error of a threshold beyond which a pixel does not count
constexpr std::uint32_t kFewestOfPixel = 6;  // equations
constexpr int kBlock = 8;                    // px
constexpr double kMostOfBlock = 0.9;
constexpr std::uint64_t kFewest = 1000;    // equations of all pixels
constexpr std::uint32_t kManyEvents = 20;  // of the neighbours of a pixel that is dead without events
const char* const kSource = "events and images of a moving scene";

}  // namespace

/// The sums of products as matrices.
struct ContrastFit::Algebra {
  static constexpr int kAll = static_cast<int>(kColumns), kOurs = static_cast<int>(kOfPixel),
                       kTheirs = static_cast<int>(kShared);
  using Matrix = Eigen::Matrix<double, kAll, kAll>;
  using Vector = Eigen::Matrix<double, kAll, 1>;
  using Shared = Eigen::Matrix<double, kTheirs, 1>;
  using SharedMatrix = Eigen::Matrix<double, kTheirs, kTheirs>;

  Matrix matrix;
  Vector vector;
  double square = 0;  // of L

  explicit Algebra(const Products& products) {
    std::size_t at = 0;
    for (int i = 0; i < kAll; ++i) {
      for (int j = i; j < kAll; ++j) matrix(i, j) = matrix(j, i) = products[at++];
      vector(i) = products[at++];
    }
    square = products[at];
  }

  /// The thresholds as a linear function of what all pixels share.
  using Own = Eigen::Matrix<double, kOurs, 1>;
  struct Thresholds {
    Own alone;
    Eigen::Matrix<double, kOurs, kTheirs> by_shared;
    Eigen::Vector2d variance;  // if that of an equation is 1

    Own own(const Shared& shared) const { return alone - by_shared * shared; }
    Eigen::Vector2d at(const Shared& shared) const { return own(shared).template head<2>(); }
  };
  std::optional<Thresholds> thresholds() const {
    const Eigen::Matrix<double, kOurs, kOurs> own = matrix.topLeftCorner<kOurs, kOurs>();
    if (!(own.determinant() > 1e-9 * own.diagonal().prod())) return std::nullopt;
    const Eigen::Matrix<double, kOurs, kOurs> inverse = own.inverse();
    return Thresholds{inverse * vector.head<kOurs>(), inverse * matrix.topRightCorner<kOurs, kTheirs>(),
                      inverse.diagonal().head<2>()};
  }
};

/// What a pixel contributes.
struct ContrastFit::Solved {
  Algebra algebra;
  Algebra::Thresholds all;
  std::array<std::optional<Algebra::Thresholds>, 2> halves;
  // Normal equations of what all pixels share.
  Algebra::SharedMatrix left;
  Algebra::Shared right;
  std::uint32_t equations = 0;
  std::size_t area = 0, block = 0;
  Eigen::Vector2d weight = Eigen::Vector2d::Zero();  // 0: the pixel does not count
  double weight_of_halves = 0;
};

ContrastFit::ContrastFit(int width, int height, const Options& options) : options_(options), pixels_(width, height) {}

void ContrastFit::add(TimeNs t, const Image<float>& intensity, EventSpan events) {
  if (intensity.width() != pixels_.width() || intensity.height() != pixels_.height()) {
    throw UserError(fmt::format("the image at {:.6f} s has {} x {} px, but the sensor {} x {} px", to_seconds(t),
                                intensity.width(), intensity.height(), pixels_.width(), pixels_.height()));
  }
  if (!images_.empty() && t <= images_.back().t)
    throw UserError(fmt::format("the image at {:.9f} s is not later than the previous one", to_seconds(t)));
  for (const Event& event : events) add_event(event);
  KeptImage image{t, {}};
  if (images_.size() == kKeptImages) {
    image.logs = std::move(images_.front().logs);
    images_.pop_front();
  }
  image.logs.resize(pixels_.size());
  const auto offset = static_cast<float>(options_.offset);
  std::transform(intensity.pixels().begin(), intensity.pixels().end(), image.logs.begin(), [offset](float value) {
    return value > 0 && std::isfinite(value) ? std::log(value + offset) : kUnknown;
  });
  images_.push_back(std::move(image));
  for (const Event& event : events) look_at_images(event);
}

void ContrastFit::add_event(const Event& event) {
  Pixel& pixel = pixels_(event.x, event.y);
  ++pixel.events;
  const double between_s = to_seconds(event.t - pixel.last);
  const bool alike = pixel.polarity == event.polarity;
  if (pixel.polarity == 0 || (alike && between_s < kShort * options_.refractory_s)) {
    close(pixel);
    pixel.chain = {};
    pixel.since = event.t;
    pixel.between = 0;
  } else {
    // Without images, what the pixel misses while its brightness turns is unknown: little, and of either sign.
    double way = alike ? between_s / (between_s - options_.refractory_s) : 1;
    if (pixel.images_apart > 0 &&
        kImagesPerEvent * pixel.images_apart < std::min(event.t - pixel.last, pixel.between)) {
      const auto slope = static_cast<double>(pixel.slope);
      add_equation(pixel, pixel.chain, pixel.last, slope, static_cast<double>(pixel.brightness));
      pixel.chain.missed += options_.refractory_s * slope;
      way = 1;
    } else if (alike) {
      compare_at_image(pixel, event, way);
    }
    pixel.chain = pixel.chain.plus(event.polarity, way);
    pixel.between = event.t - pixel.last;
  }
  pixel.last = event.t;
  pixel.polarity = event.polarity;
  pixel.images_apart = 0;
}

/// Takes the brightness at an event from the last two images, which are around it.
void ContrastFit::look_at_images(const Event& event) {
  Pixel& pixel = pixels_(event.x, event.y);
  if (pixel.last != event.t || images_.size() < 2) return;  // a later event of the pixel matters
  const KeptImage &before = images_[images_.size() - 2], &after = images_.back();
  const std::size_t i = static_cast<std::size_t>(event.y) * static_cast<std::size_t>(pixels_.width()) + event.x;
  const auto l0 = static_cast<double>(before.logs[i]), l1 = static_cast<double>(after.logs[i]);
  if (!std::isfinite(l0 + l1)) return;
  const double slope = (l1 - l0) / to_seconds(after.t - before.t);
  pixel.slope = static_cast<float>(slope);
  pixel.brightness = static_cast<float>(l0 + slope * to_seconds(event.t - before.t));
  pixel.images_apart = after.t - before.t;
}

/// The first image between the last event of a pixel and `event`, in whose time L moves by `way` thresholds.
void ContrastFit::compare_at_image(Pixel& pixel, const Event& event, double way) const {
  const auto later = [](TimeNs t, const KeptImage& image) { return t < image.t; };
  const auto image = std::upper_bound(images_.begin(), images_.end(), pixel.last, later);
  // Without an image before the last event, there may have been others after it.
  if (image == images_.end() || image == images_.begin()) return;
  const std::size_t i = static_cast<std::size_t>(event.y) * static_cast<std::size_t>(pixels_.width()) + event.x;
  const double between_s = to_seconds(event.t - pixel.last), part = to_seconds(image->t - pixel.last) / between_s;
  // The slope needs a threshold, which is not known yet.
  const double slope = event.polarity * kTypicalThreshold * way / between_s;
  add_equation(pixel, pixel.chain.plus(event.polarity, way * part), image->t, slope,
               static_cast<double>(image->logs[i]));
}

void ContrastFit::add_equation(Pixel& pixel, const Chain& chain, TimeNs t, double slope, double brightness) const {
  if (!std::isfinite(brightness)) return;
  const std::array<double, kValues> row{chain.on,
                                        -chain.off,
                                        -to_seconds(t - pixel.since),
                                        slope,
                                        static_cast<double>(pixel.polarity),
                                        options_.find_offset ? -std::exp(-brightness) : 0.0,
                                        brightness - chain.missed};
  std::size_t at = 0;
  for (std::size_t j = 0; j < kValues; ++j) {
    pixel.sums[j] += row[j];
    for (std::size_t k = j; k < kValues; ++k) pixel.products[at++] += row[j] * row[k];
  }
  if (++pixel.count == kStretch) close(pixel);
}

/// Ends a stretch: adds its products about their means to those of its half.
void ContrastFit::close(Pixel& pixel) {
  if (pixel.count > 2) {
    const std::size_t half = pixel.stretches++ % 2;
    std::size_t at = 0;
    for (std::size_t i = 0; i < kValues; ++i) {
      for (std::size_t j = i; j < kValues; ++j, ++at)
        pixel.halves[half][at] += pixel.products[at] - pixel.sums[i] * pixel.sums[j] / pixel.count;
    }
    pixel.equations[half] += pixel.count - 1;  // the constant uses up one
  }
  pixel.count = 0;
  pixel.sums = {}, pixel.products = {};
}

void ContrastFit::end_recording() {
  for (Pixel& pixel : pixels_.pixels()) {
    close(pixel);
    pixel.polarity = 0;
  }
  images_.clear();
}

/// The pixels that determine their thresholds.
std::vector<ContrastFit::Solved> ContrastFit::solve() const {
  constexpr int kOurs = Algebra::kOurs, kTheirs = Algebra::kTheirs;
  std::vector<Solved> result;
  const AreaGrid areas(pixels_.width(), pixels_.height());
  for (int y = 0; y < pixels_.height(); ++y) {
    for (int x = 0; x < pixels_.width(); ++x) {
      const Pixel& pixel = pixels_(x, y);
      const std::uint32_t equations = pixel.equations[0] + pixel.equations[1];
      if (equations < kFewestOfPixel) continue;
      Products products = pixel.halves[0];
      for (std::size_t i = 0; i < products.size(); ++i) products[i] += pixel.halves[1][i];
      const Algebra algebra(products);
      const auto thresholds = algebra.thresholds();
      if (!thresholds) continue;
      Solved s{algebra, *thresholds, {}, {}, {}, equations, areas.of(x, y), block_of(x, y)};
      for (std::size_t half = 0; half < 2; ++half) {
        if (pixel.equations[half] >= kFewestOfPixel) s.halves[half] = Algebra(pixel.halves[half]).thresholds();
      }
      const auto across = algebra.matrix.bottomLeftCorner<kTheirs, kOurs>();
      s.left = algebra.matrix.bottomRightCorner<kTheirs, kTheirs>() - across * thresholds->by_shared;
      s.right = algebra.vector.tail<kTheirs>() - across * thresholds->alone;
      result.push_back(s);
    }
  }
  return result;
}

ContrastFit::Result ContrastFit::finish() {
  Result result;
  const auto unknown = [&](const std::string& why) {
    result.on = Estimate::unknown("contrast_threshold_on", "", why);
    result.off = Estimate::unknown("contrast_threshold_off", "", why);
    result.mismatch = Estimate::unknown("threshold_mismatch", "", why);
    result.common = Estimate::unknown("circuit.threshold_mismatch_common", "", why);
    result.delay = Estimate::unknown("delay", "us", why);
    result.offset = Estimate::unknown("offset", "", why);
    result.dead = Estimate::unknown("dead_pixels", "", why);
    return result;
  };
  end_recording();
  std::vector<Solved> solved = solve();
  for (const Solved& s : solved) result.equations += s.equations;
  if (result.equations < kFewest) {
    return unknown(fmt::format("only {} events lie near images of a scene that moves; at least {} are necessary",
                               result.equations, kFewest));
  }

  // What all pixels share, by least squares; without some area.
  using Shared = Algebra::Shared;
  const auto shared_of = [&](std::optional<std::size_t> without) -> Shared {
    Algebra::SharedMatrix left = Algebra::SharedMatrix::Zero();
    Shared right = Shared::Zero();
    for (const Solved& s : solved) {
      if (s.area != without) left += s.left, right += s.right;
    }
    // What the recording does not determine is 0.
    const Eigen::SelfAdjointEigenSolver<Algebra::SharedMatrix> solver(left);
    Shared along = solver.eigenvectors().transpose() * right;
    for (int i = 0; i < Algebra::kTheirs; ++i) {
      const double value = solver.eigenvalues()(i);
      along(i) = value > 1e-12 * solver.eigenvalues().maxCoeff() ? along(i) / value : 0.0;
    }
    return solver.eigenvectors() * along;
  };
  const Shared shared = shared_of(std::nullopt);
  double squares = 0, degrees = 0, total = 0;
  for (const Solved& s : solved) {
    Algebra::Vector found;
    found << s.all.own(shared), shared;
    squares += s.algebra.square - 2 * found.dot(s.algebra.vector) + found.dot(s.algebra.matrix * found);
    total += s.algebra.square;
    degrees += std::max(0.0, s.equations - static_cast<double>(kOfPixel));
  }
  const double variance = squares / degrees;
  result.residual = std::sqrt(std::max(0.0, variance));

  result.explained = 1 - squares / total;
  if (!(result.explained > kExplained)) {
    return unknown(
        fmt::format("the events explain only {:.0f} % of the changes of brightness in the images: they do not "
                    "show the same motion",
                    100 * std::max(0.0, result.explained)));
  }
  Eigen::Vector2d typical;
  for (int k = 0; k < 2; ++k) {
    std::vector<double> values;
    for (const Solved& s : solved) values.push_back(s.all.at(shared)(k));
    typical(k) = median(std::move(values));
  }
  if (!(typical.minCoeff() > 0))
    return unknown("the brightness of the images falls at ON events or rises at OFF events");

  // Pixels with precise thresholds count more.
  const AreaGrid grid(pixels_.width(), pixels_.height());
  std::vector<bool> used(grid.areas());
  const auto variances = [&](const Algebra::Thresholds& t) -> Eigen::Vector2d { return variance * t.variance; };
  const auto is_good = [&](const std::optional<Algebra::Thresholds>& t) {
    return t && variances(*t).cwiseSqrt().cwiseQuotient(typical).maxCoeff() < kPoor;
  };
  double in_halves = 0;
  std::vector<int> good(block_of(pixels_.width() - 1, pixels_.height() - 1) + 1);
  for (const Solved& s : solved) good[s.block] += is_good(s.all);
  for (Solved& s : solved) {
    if (!is_good(s.all) || good[s.block] < kMostOfBlock * kBlock * kBlock) continue;
    result.pixels += 1;
    const Eigen::Vector2d spread = (kTypicalSpread * typical).cwiseAbs2();
    s.weight = (spread + variances(s.all)).cwiseInverse();
    if (is_good(s.halves[0]) && is_good(s.halves[1])) s.weight_of_halves = s.weight.prod(), in_halves += 1;
    used[s.area] = true;
  }

  enum Value : std::size_t { kOn, kOff, kOwnPart, kCommonPart, kDelay, kOffset };
  const auto evaluate = [&](std::optional<std::size_t> without) {
    const Shared common = shared_of(without);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero(), weights = sum, first = sum, second = sum;
    Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
    double n = 0;
    for (const Solved& s : solved) {
      if (s.area == without) continue;
      sum += s.weight.cwiseProduct(s.all.at(common)), weights += s.weight;
      if (s.weight_of_halves == 0) continue;
      const Eigen::Vector2d a = s.halves[0]->at(common), b = s.halves[1]->at(common);
      first += s.weight_of_halves * a, second += s.weight_of_halves * b, n += s.weight_of_halves;
      products += s.weight_of_halves * 0.5 * (a * b.transpose() + b * a.transpose());
    }
    const Eigen::Vector2d mean = sum.cwiseQuotient(weights);
    first /= n, second /= n;
    const Eigen::Matrix2d covariance = products / n - 0.5 * (first * second.transpose() + second * first.transpose());
    const double both = covariance(0, 1) / mean.prod();
    const double own = 0.5 * (covariance.trace() - both * mean.squaredNorm());
    return std::vector<double>{mean(0), mean(1), own, both, common(0), common(2)};
  };
  const auto found = jackknife(used, evaluate);
  if (!found) {
    return unknown(
        fmt::format("only in {} of {} areas of the sensor, enough pixels have enough events near images; at "
                    "least {} are necessary: record longer, or more texture",
                    std::count(used.begin(), used.end(), true), used.size(), kFewestAreas));
  }
  const auto estimate = [&](const char* name, const char* unit, Value which, double factor) {
    const Jackknifed& j = (*found)[which];
    Estimate e;
    e.name = name, e.unit = unit, e.source = kSource;
    e.value = factor * j.value, e.low = factor * j.low(), e.high = factor * j.high();
    return e;
  };
  const auto not_negative = [](Estimate e) {
    for (double* value : {&e.value, &e.low, &e.high}) *value = std::max(0.0, *value);
    return e;
  };
  const auto root = [&](const char* name, Value which) {  // of a variance, which may come out below 0
    Estimate e = not_negative(estimate(name, "", which, 1));
    for (double* value : {&e.value, &e.low, &e.high}) *value = std::sqrt(*value);
    return in_halves < 0.5 * static_cast<double>(result.pixels)
               ? Estimate::unknown(name, "", "too few pixels have enough events in two parts of the recording")
               : e;
  };
  result.on = estimate("contrast_threshold_on", "", kOn, 1);
  result.off = estimate("contrast_threshold_off", "", kOff, 1);
  result.mismatch = root("threshold_mismatch", kOwnPart);
  result.common = root("circuit.threshold_mismatch_common", kCommonPart);
  result.delay = estimate("delay", "us", kDelay, 1e6);
  result.offset =
      options_.find_offset ? estimate("offset", "", kOffset, 1) : Estimate::unknown("offset", "", "not asked for");
  if (options_.find_offset) {
    for (double* value : {&result.offset.value, &result.offset.low, &result.offset.high}) *value += options_.offset;
  }

  for (int k = 0; k < 2; ++k) {
    FittedDistribution& d = k == 0 ? result.pixels_on : result.pixels_off;
    d.title = k == 0 ? "ON thresholds of the pixels" : "OFF thresholds of the pixels", d.axis = "threshold (ln)";
    std::vector<double> errors;
    for (const Solved& s : solved) {
      if (s.weight(k) == 0) continue;
      d.values.push_back(s.all.at(shared)(k));
      errors.push_back(variances(s.all)(k));
    }
    const double mean = (*found)[k == 0 ? kOn : kOff].value;
    const double spread = std::max(0.0, (*found)[kOwnPart].value + (*found)[kCommonPart].value * mean * mean);
    d.density = normal_density(mean, std::sqrt(spread + median(std::move(errors))));
  }
  result.dead = find_dead_pixels();
  return result;
}

std::size_t ContrastFit::block_of(int x, int y) const {
  const int blocks = (pixels_.width() + kBlock - 1) / kBlock;
  return static_cast<std::size_t>(y / kBlock * blocks + x / kBlock);
}

/// Pixels without events whose neighbours have many.
Estimate ContrastFit::find_dead_pixels() const {
  std::uint64_t watched = 0, dead = 0;
  for (int y = 0; y < pixels_.height(); ++y) {
    for (int x = 0; x < pixels_.width(); ++x) {
      std::vector<double> around;
      for (int v = std::max(0, y - 1); v <= std::min(pixels_.height() - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(pixels_.width() - 1, x + 1); ++u) {
          if (u != x || v != y) around.push_back(pixels_(u, v).events);
        }
      }
      if (around.empty() || median(std::move(around)) < kManyEvents) continue;
      ++watched;
      dead += pixels_(x, y).events == 0;
    }
  }
  return fraction_estimate("dead_pixels", dead, watched, kSource);
}

}  // namespace esim::inline fit

#include "esim/event_camera/circuit/photoreceptor_noise.h"

#include <fmt/format.h>

#include "esim/core/error.h"
#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

constexpr double kPoleStep = 1.01;   // ratio of successive time constants t1
constexpr double kNeglected = 0.01;  // maximum deviation of x from a cubic within a step, in deviations of x
constexpr int kLevelsBelowLeaves = 4;
constexpr std::uint32_t kStepAddresses = 0x80000000;  // above those of the tree of node 0
constexpr double kBoundDeviations = 5;

/// A symmetric 2 x 2 matrix.
struct Covariance {
  double yy = 0, xy = 0, xx = 0;
};

/// The lower triangular root of a covariance, which may be singular by rounding.
NoiseMatrix root(const Covariance& c) {
  const double yy = std::sqrt(std::max(c.yy, 0.0));
  const double xy = yy > 0 ? c.xy / yy : 0.0;
  return {yy, 0.0, xy, std::sqrt(std::max(c.xx - xy * xy, 0.0))};
}

NoiseMatrix product(const NoiseMatrix& a, const NoiseMatrix& b) {
  return {a.yy * b.yy + a.yx * b.xy, a.yy * b.yx + a.yx * b.xx, a.xy * b.yy + a.xx * b.xy, a.xy * b.yx + a.xx * b.xx};
}

NoiseMatrix full(const Covariance& c) { return {c.yy, c.xy, c.xy, c.xx}; }
NoiseMatrix transposed(const NoiseMatrix& m) { return {m.yy, m.xy, m.yx, m.xx}; }
NoiseMatrix difference(const NoiseMatrix& a, const NoiseMatrix& b) {
  return {a.yy - b.yy, a.yx - b.yx, a.xy - b.xy, a.xx - b.xx};
}

NoiseMatrix inverse(const NoiseMatrix& m) {
  const double determinant = m.yy * m.xx - m.yx * m.xy;
  return {m.xx / determinant, -m.yx / determinant, -m.xy / determinant, m.yy / determinant};
}

NoiseState plus(const NoiseState& a, const NoiseState& b) { return {a.y + b.y, a.x + b.x}; }

/// Drift over h: y decays with t1, x follows it with t2.
NoiseMatrix drift(double t1, double t2, double h) {
  const double e1 = std::exp(-h / t1), e2 = std::exp(-h / t2), gain = t1 / (t1 - t2);
  return {e1, 0.0, gain * (e1 - e2), e2};
}

/// Covariance of the noise that is added over h: the integral of drift(s) [B 0; 0 0] drift(s)' over s from 0 to h, with
/// B = 2 variance / t1. The closed form cancels for short steps; a series is not needed, since Gauss-Legendre with
/// eight points is exact to rounding for steps shorter than the time constants, and longer ones are composed of halves.
Covariance added(double variance, double t1, double t2, double h) {
  if (h > 0.5 * std::min(t1, t2)) {
    const Covariance half = added(variance, t1, t2, 0.5 * h);
    const NoiseMatrix a = drift(t1, t2, 0.5 * h);
    const NoiseMatrix moved = product(product(a, full(half)), transposed(a));
    return {half.yy + moved.yy, half.xy + moved.xy, half.xx + moved.xx};
  }
  constexpr std::array<double, 4> kNodes{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                         0.9602898564975363};
  constexpr std::array<double, 4> kWeights{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                           0.1012285362903763};
  const double power = 2 * variance / t1;
  Covariance sum;
  for (std::size_t i = 0; i < kNodes.size(); ++i) {
    for (const double sign : {-1.0, 1.0}) {
      const NoiseMatrix m = drift(t1, t2, 0.5 * h * (1 + sign * kNodes[i]));
      const double weight = 0.5 * h * kWeights[i] * power;
      sum.yy += weight * m.yy * m.yy;
      sum.xy += weight * m.yy * m.xy;
      sum.xx += weight * m.xy * m.xy;
    }
  }
  return sum;
}

}  // namespace

PhotoreceptorNoise::PhotoreceptorNoise(double variance, double t2_ns, double t1_min_ns, double t1_max_ns,
                                       const AddressedRandom& random)
    : variance_(variance),
      t2_(t2_ns),
      log_first_(std::log(t1_min_ns)),
      per_log_step_(1 / std::log(kPoleStep)),
      coarse_(0.6 * t2_ns),
      random_(random) {
  if (!(variance > 0) || !(t2_ns > 0) || !(t1_min_ns > 0) || !(t1_max_ns >= t1_min_ns))
    throw UserError(
        fmt::format("photoreceptor noise: variance ({}), time constants t2 ({} ns) and t1 ({} to {} ns) must "
                    "be above 0, in this order",
                    variance, t2_ns, t1_min_ns, t1_max_ns));
  const auto count = static_cast<std::size_t>(std::ceil((std::log(t1_max_ns) - log_first_) * per_log_step_)) + 1;
  for (std::size_t i = 0; i < count; ++i) {
    Pole pole;
    pole.t1 = std::exp(log_first_ + static_cast<double>(i) / per_log_step_);
    if (std::abs(pole.t1 / t2_ - 1) < 0.004) pole.t1 = t2_ * 1.004;  // the formulae divide by t1 - t2
    pole.deviation = std::sqrt(variance_ * pole.t1 / (pole.t1 + t2_));
    const double longest = 4 * (pole.t1 + t2_);
    for (int k = 0; k < kSteps; ++k)
      pole.steps[static_cast<std::size_t>(k)] = make_step(pole.t1, std::ldexp(longest, -k));
    int leaves = 0;
    for (int k = 0; leaves <= kLevelsBelowLeaves; ++k) {
      pole.bridges.push_back(make_bridge(pole.t1, std::ldexp(longest, -k)));
      leaves += pole.bridges.back().leaf ? 1 : 0;
    }
    pole.step_bridge = pole.bridges.size();
    const double step = step_length(pole.t1);
    for (int k = -kDrifts; k <= kDrifts; ++k) {
      double t1 = pole.t1 * std::exp(kDriftStep * k);
      if (std::abs(t1 / t2_ - 1) < 0.004) t1 = t2_ * 1.004;
      pole.drifting[static_cast<std::size_t>(k + kDrifts)] = make_step(t1, step);
    }
    pole.steps[kSteps] = pole.drifting[kDrifts];
    while (pole.first_in_steps < kSteps && pole.steps[static_cast<std::size_t>(pole.first_in_steps)].h > 8 * step)
      ++pole.first_in_steps;
    for (int k = 0; k <= kLevelsBelowLeaves; ++k) pole.bridges.push_back(make_bridge(pole.t1, std::ldexp(step, -k)));
    poles_.push_back(std::move(pole));
  }
}

PhotoreceptorNoise::Step PhotoreceptorNoise::make_step(double t1, double h) const {
  return {h, drift(t1, t2_, h), root(added(variance_, t1, t2_, h))};
}

/// The longest interval within which x is a cubic, except for kNeglected.
double PhotoreceptorNoise::step_length(double t1) const {
  double shortest = 0.1 * std::min(t1, t2_), longest = 4 * std::max(t1, t2_);
  for (int k = 0; k < 30; ++k) {
    const double h = std::sqrt(shortest * longest);
    (make_bridge(t1, h).leaf ? shortest : longest) = h;
  }
  return shortest;
}

PhotoreceptorNoise::Bridge PhotoreceptorNoise::make_bridge(double t1, double h) const {
  // Middle M = A S0 + n1, end S1 = A M + n2, n1 and n2 of covariance C. Given both ends, M has the mean
  // A S0 + K (S1 - A^2 S0) with K = C A' (A C A' + C)^-1, and the covariance C - K A C.
  const NoiseMatrix a = drift(t1, t2_, 0.5 * h);
  const NoiseMatrix c = full(added(variance_, t1, t2_, 0.5 * h));
  const NoiseMatrix c_end = full(added(variance_, t1, t2_, h));  // A C A' + C
  const NoiseMatrix k = product(product(c, transposed(a)), inverse(c_end));
  const NoiseMatrix covariance = difference(c, product(product(k, a), c));
  Bridge bridge;
  bridge.h = h;
  bridge.from_end = k;
  bridge.from_start = difference(a, product(k, product(a, a)));
  bridge.spread = root({covariance.yy, 0.5 * (covariance.xy + covariance.yx), covariance.xx});
  bridge.deviation = std::sqrt(std::max(covariance.xx, 0.0));
  const double deviation = std::sqrt(variance_ * t1 / (t1 + t2_));
  bridge.leaf = bridge.deviation <= kNeglected * deviation;
  return bridge;
}

PhotoreceptorNoise::Interval PhotoreceptorNoise::first(std::uint32_t pixel, std::int32_t pole, std::int32_t level,
                                                       StepDraws& draws) const {
  // Stationary: Var y = v, Var x = Cov xy = v t1 / (t1 + t2). Draw 0 of node 0 belongs to this state alone.
  const double t1 = poles_[static_cast<std::size_t>(pole)].t1, common = variance_ * t1 / (t1 + t2_);
  const auto n = random_.normals(pixel, 0);
  return next(root({variance_, common, common}) * NoiseState{n[0], n[1]}, pixel, 0, pole, level, 0, draws);
}

PhotoreceptorNoise::Interval PhotoreceptorNoise::next(const NoiseState& from, std::uint32_t pixel, std::uint32_t node,
                                                      std::int32_t pole, std::int32_t level, double drift,
                                                      StepDraws& draws) const {
  const Step& step = poles_[static_cast<std::size_t>(pole)].steps[static_cast<std::size_t>(level)];
  Interval interval{from, {}, pixel, node, pole, level, step.h};
  if (level == kSteps) {
    interval.to = after_step(from, pixel, node, pole, drift, draws);
    return interval;
  }
  const auto n = normals(interval, 1);
  interval.to = plus(step.drift * from, step.spread * NoiseState{n[0], n[1]});
  return interval;
}

/// Standard normal deviates by the Box-Muller method in single precision: the radius from 32 random bits, at most 6.7.
void PhotoreceptorNoise::draw_block(std::uint32_t pixel, std::uint32_t block, StepDraws& draws) const {
  alignas(64) std::array<std::uint32_t, 16> items, addresses;
  items.fill(pixel);
  for (std::uint32_t i = 0; i < 16; ++i) addresses[i] = kStepAddresses | (kBlock * block + i);
  alignas(64) std::array<std::array<std::uint32_t, 16>, 4> words;
  random_.bits(kBlock, items.data(), addresses.data(),
               {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  const auto unit = [&](const std::uint32_t* from) {  // in (0, 1): the upper 31 bits and a half
    const auto halves = hn::BitCast(di, hn::ShiftRight<1>(hn::LoadU(du, from)));
    return hn::MulAdd(hn::ConvertTo(d, halves), hn::Set(d, 0x1p-31F), hn::Set(d, 0x1p-32F));
  };
  for (std::size_t i = 0; i < kBlock; i += hn::Lanes(d)) {
    const auto radius = hn::Sqrt(hn::Max(hn::Zero(d), hn::Mul(hn::Set(d, -2.0F), logarithm(d, unit(&words[0][i])))));
    auto cosine = hn::Zero(d), sine = cosine;
    cosine_and_sine(d, unit(&words[1][i]), cosine, sine);
    hn::StoreU(hn::Mul(radius, cosine), d, &draws.first[i]);
    hn::StoreU(hn::Mul(radius, sine), d, &draws.second[i]);
  }
  draws.block = block;
}

NoiseState PhotoreceptorNoise::after(const NoiseState& from, double gap, std::uint32_t pixel, std::uint32_t node,
                                     std::int32_t pole) const {
  // The closed form of added(), which is exact enough except for steps far below the time constants.
  const double t1 = poles_[static_cast<std::size_t>(pole)].t1, h = std::max(gap, 1e-3 * std::min(t1, t2_));
  const double e1 = std::exp(-h / t1), e2 = std::exp(-h / t2_), gain = t1 / (t1 - t2_), power = 2 * variance_ / t1;
  const double yy = variance_ * (1 - e1 * e1), uu = gain * gain * power * t2_ / 2 * (1 - e2 * e2);
  const double cross = -gain * power * t1 * t2_ / (t1 + t2_) * (1 - e1 * e2);
  const auto n = random_.normals(pixel, (std::uint64_t{node} << 32) | 1);
  const NoiseState drawn =
      root({yy, cross + gain * yy, uu + 2 * gain * cross + gain * gain * yy}) * NoiseState{n[0], n[1]};
  const NoiseState drifted = drift(t1, t2_, gap) * from;
  const double part = gap < h ? std::sqrt(gap / h) : 1.0;
  return {drifted.y + part * drawn.y, drifted.x + part * drawn.x};
}

NoiseState PhotoreceptorNoise::middle(const Interval& interval, const Piece& piece, const Bridge& bridge) const {
  const auto n = normals(interval, 2 * piece.index);  // index 1 is the draw of the interval's end
  return plus(plus(bridge.from_start * piece.from, bridge.from_end * piece.to), bridge.spread * NoiseState{n[0], n[1]});
}

NoiseState PhotoreceptorNoise::at(const Interval& interval, double tau) const {
  const Pole& pole = poles_[static_cast<std::size_t>(interval.pole)];
  Piece piece{interval.from, interval.to, 0.0, 1, pole.bridge_of(interval.level)};
  const std::size_t last = interval.level == kSteps ? pole.bridges.size() - 1 : pole.step_bridge - 1;
  const auto descend = [&](const Bridge& bridge) {
    const NoiseState centre = middle(interval, piece, bridge);
    const double half = piece.start + 0.5 * bridge.h;
    if (tau < half) {
      piece = {piece.from, centre, piece.start, 2 * piece.index, piece.bridge + 1};
    } else {
      piece = {centre, piece.to, half, 2 * piece.index + 1, piece.bridge + 1};
    }
  };
  while (!pole.bridges[piece.bridge].leaf) descend(pole.bridges[piece.bridge]);
  const NoiseCubic x{piece.from.x, slope(piece.from), piece.to.x, slope(piece.to), pole.bridges[piece.bridge].h};
  const double here = x.value(tau - piece.start);
  // y is rough: the line between the ends of a much shorter piece has its variance.
  while (piece.bridge < last) descend(pole.bridges[piece.bridge]);
  const double u = (tau - piece.start) / pole.bridges[piece.bridge].h;
  return {piece.from.y + u * (piece.to.y - piece.from.y), here};
}

std::pair<double, double> PhotoreceptorNoise::bounds(const Piece& piece, const Bridge& bridge) const {
  const double reach = std::min(bridge.h / 3, t2_), margin = kBoundDeviations * bridge.deviation;
  const auto [low, high] = std::minmax(
      {piece.from.x, piece.to.x, piece.from.x + slope(piece.from) * reach, piece.to.x - slope(piece.to) * reach});
  return {low - margin, high + margin};
}

std::optional<std::pair<double, int>> NoiseCubic::first_exit(double lower, double upper) const {
  if (v0 >= upper) return std::pair{0.0, 1};
  if (v0 <= lower) return std::pair{0.0, -1};
  // The extrema lie at the roots of the slope, a parabola a u^2 + b u + c in u = t / h.
  const double a = 6 * (v0 - v1) + 3 * h * (s0 + s1), b = 6 * (v1 - v0) - 2 * h * (2 * s0 + s1), c = h * s0;
  std::array<double, 4> ends{0.0, h, h, h};
  std::size_t count = 1;
  const double discriminant = b * b - 4 * a * c;
  if (discriminant > 0) {
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    std::array<double, 2> roots{a != 0 ? q / a : -1.0, q != 0 ? c / q : -1.0};
    std::sort(roots.begin(), roots.end());
    for (const double root : roots) {
      if (root > 0 && root < 1) ends[count++] = root * h;
    }
  }
  ends[count] = h;
  // Monotone between successive ends: bisection cannot miss a crossing.
  for (std::size_t i = 1; i <= count; ++i) {
    const double v = i == count ? v1 : value(ends[i]);
    const int polarity = v >= upper ? 1 : v <= lower ? -1 : 0;
    if (polarity == 0) continue;
    double before = ends[i - 1], after = ends[i];
    const double level = polarity > 0 ? upper : lower;
    for (int k = 0; k < 60 && after - before > 1e-3 * h; ++k) {
      const double centre = 0.5 * (before + after), here = value(centre);
      (polarity > 0 ? here >= upper : here <= lower) ? after = centre : before = centre;
    }
    // Newton's method, so that the time hardly depends on where the search began.
    double t = 0.5 * (before + after);
    for (int k = 0; k < 4; ++k) {
      const double rate = slope(t);
      if (rate * polarity <= 0) return std::pair{after, polarity};
      t = std::clamp(t - (value(t) - level) / rate, before, after);
    }
    return std::pair{t, polarity};
  }
  return std::nullopt;
}

}  // namespace esim::inline event_camera

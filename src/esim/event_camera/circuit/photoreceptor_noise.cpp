#include "esim/event_camera/circuit/photoreceptor_noise.h"

#include <fmt/format.h>

#include <utility>

#include "esim/core/error.h"
#include "esim/core/vector_math.h"
#include "esim/event_camera/circuit/photoreceptor_vectors.h"

namespace esim::inline event_camera {
namespace {

constexpr double kPoleStep = 1.01;  // ratio of successive time constants t1
// Standard deviation of x in the middle of an interval with known ends, in deviations of x: of steps, and where x is
// taken for a cubic.
constexpr double kUnknown = 0.24, kNeglected = 0.015;
// A root is found when a step of Newton's method is shorter than this, relative to the interval.
constexpr double kRootStep = 1e-6;
// Addresses of draws: those of steps, 8 i + j with j = 1 to 7 within step i, 0 of the first state, others above 32
// bits.
constexpr std::uint32_t kNodeAddresses = 0x80000000;

/// A 2 x 2 matrix that acts on (y, x).
struct NoiseMatrix {
  double yy = 0, yx = 0, xy = 0, xx = 0;

  NoiseState apply(double y, double x) const {
    return {static_cast<float>(yy * y + yx * x), static_cast<float>(xy * y + xx * x)};
  }
};

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

/// Pairs of standard normal deviates from two words each, by the Box-Muller method in single precision: the radius from
/// 31 random bits, at most 6.7. All arrays are read and written up to `count` rounded up to a multiple of 8.
void normals(std::size_t count, const std::uint32_t* first, const std::uint32_t* second, float* n1, float* n2) {
  const NoiseLanes d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::RebindToUnsigned<decltype(d)> du;
  const auto unit = [&](const std::uint32_t* from) {  // in (0, 1): the upper 31 bits and a half
    const auto halves = hn::BitCast(di, hn::ShiftRight<1>(hn::LoadU(du, from)));
    return hn::MulAdd(hn::ConvertTo(d, halves), hn::Set(d, 0x1p-31F), hn::Set(d, 0x1p-32F));
  };
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto logarithms = logarithm(d, unit(first + i));
    const auto radius = hn::Sqrt(hn::Max(hn::Zero(d), hn::Mul(hn::Set(d, -2.0F), logarithms)));
    auto cosine = hn::Zero(d), sine = cosine;
    cosine_and_sine(d, unit(second + i), cosine, sine);
    hn::StoreU(hn::Mul(radius, cosine), d, n1 + i);
    hn::StoreU(hn::Mul(radius, sine), d, n2 + i);
  }
}

/// `t1` at a distance from t2, since the formulas divide by t1 - t2.
double apart(double t1, double t2) { return std::abs(t1 / t2 - 1) < 0.004 ? t2 * 1.004 : t1; }

}  // namespace

PhotoreceptorNoise::PhotoreceptorNoise(double variance, double t2_ns, double t1_min_ns, double t1_max_ns,
                                       const AddressedRandom& random)
    : variance_(variance),
      t2_(t2_ns),
      log_first_(std::log(t1_min_ns)),
      per_log_step_(1 / std::log(kPoleStep)),
      random_(random) {
  if (!(variance > 0) || !(t2_ns > 0) || !(t1_min_ns > 0) || !(t1_max_ns >= t1_min_ns))
    throw UserError(
        fmt::format("photoreceptor noise: variance ({}), time constants t2 ({} ns) and t1 ({} to {} ns) must "
                    "be above 0, in this order",
                    variance, t2_ns, t1_min_ns, t1_max_ns));
  const auto count = static_cast<std::size_t>(std::ceil((std::log(t1_max_ns) - log_first_) * per_log_step_)) + 1;
  poles_ = std::make_shared<Poles>();
  poles_->all = std::vector<Pole>(count);
  for (std::size_t i = 0; i < count; ++i) {
    Pole& pole = poles_->all[i];
    pole.t1 = apart(std::exp(log_first_ + static_cast<double>(i) / per_log_step_), t2_);
    pole.deviation = std::sqrt(variance_ * pole.t1 / (pole.t1 + t2_));
    deviations_.push_back(pole.deviation);
  }
  deviations_.push_back(deviations_.back());
  last_place_ = static_cast<double>(count - 1);
}

void PhotoreceptorNoise::find_steps(Pole& pole) const {
  const std::scoped_lock lock(poles_->finding);
  if (pole.found) return;
  double shortest = 0.1 * std::min(pole.t1, t2_), longest = 4 * std::max(pole.t1, t2_);
  const auto deviation_within = [&](double h) { return static_cast<double>(make_bridge(pole.t1, h).deviation); };
  for (int k = 0; k < 30; ++k) {
    const double h = std::sqrt(shortest * longest);
    (deviation_within(h) <= kUnknown * pole.deviation ? shortest : longest) = h;
  }
  while (deviation_within(shortest / kParts) > kNeglected * pole.deviation) shortest *= 0.9;
  pole.step_ns = shortest;
  double length = pole.step_ns;
  for (Bridge& bridge : pole.bridges) bridge = make_bridge(pole.t1, length), length *= 0.5;
  pole.along = static_cast<float>(std::min(pole.step_ns / 3, t2_) / t2_);
  pole.margin = kBoundDeviations * pole.bridges[0].deviation;
  pole.step = make_step(pole);
  pole.found.store(true, std::memory_order_release);
}

PhotoreceptorNoise::Step PhotoreceptorNoise::make_step(const Pole& pole) const {
  // Parabolas through the factors at three drifts.
  const double apart_by = kMaxDrift * std::sqrt(0.75);
  std::array<std::array<double, Step::kFactors>, 3> factors{};
  for (const int k : {-1, 0, 1}) {
    const double t1 = apart(pole.t1 * std::exp(k * apart_by), t2_);
    const NoiseMatrix moved = drift(t1, t2_, pole.step_ns), drawn = root(added(variance_, t1, t2_, pole.step_ns));
    factors[static_cast<std::size_t>(k + 1)] = {moved.yy, moved.xy, drawn.yy, drawn.xy, drawn.xx};
  }
  Step step;
  for (std::size_t i = 0; i < Step::kFactors; ++i) {
    const double low = factors[0][i], middle = factors[1][i], high = factors[2][i];
    step.parabolas[i] = {static_cast<float>(middle), static_cast<float>((high - low) / (2 * apart_by)),
                         static_cast<float>((high + low - 2 * middle) / (2 * apart_by * apart_by))};
  }
  step.xx = static_cast<float>(std::exp(-pole.step_ns / t2_));
  return step;
}

PhotoreceptorNoise::Bridge PhotoreceptorNoise::make_bridge(double t1, double h) const {
  // Middle M = A S0 + n1, end S1 = A M + n2, n1 and n2 of covariance C. Given both ends, M has the mean
  // A S0 + K (S1 - A^2 S0) with K = C A' (A C A' + C)^-1, and the covariance C - K A C.
  const NoiseMatrix a = drift(t1, t2_, 0.5 * h), c = full(added(variance_, t1, t2_, 0.5 * h));
  const NoiseMatrix k = product(product(c, transposed(a)), inverse(full(added(variance_, t1, t2_, h))));
  const NoiseMatrix covariance = difference(c, product(product(k, a), c));
  const NoiseMatrix from = difference(a, product(k, product(a, a)));
  const NoiseMatrix spread = root({covariance.yy, 0.5 * (covariance.xy + covariance.yx), covariance.xx});
  const auto row = [](const std::array<double, 6>& values) {
    std::array<float, 6> floats{};
    std::transform(values.begin(), values.end(), floats.begin(), [](double v) { return static_cast<float>(v); });
    return floats;
  };
  return {row({from.yy, from.yx, k.yy, k.yx, spread.yy, 0.0}),
          row({from.xy, from.xx, k.xy, k.xx, spread.xy, spread.xx}),
          static_cast<float>(std::sqrt(std::max(covariance.xx, 0.0)))};
}

PhotoreceptorNoise::Path PhotoreceptorNoise::path(const NoiseState& from, const NoiseState& to, std::uint32_t pixel,
                                                  std::uint32_t node, std::int32_t pole) const {
  alignas(64) std::array<std::uint32_t, 16> items, addresses;
  items.fill(pixel);
  for (std::uint32_t i = 0; i < 16; ++i) addresses[i] = (kParts * node + i) & ~kNodeAddresses;
  alignas(64) std::array<std::array<std::uint32_t, 16>, 4> words;
  random_.bits(kParts, items.data(), addresses.data(),
               {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  alignas(64) std::array<float, 16> n1, n2;
  normals(kParts, words[0].data(), words[1].data(), n1.data(), n2.data());
  Path path;
  path.y[0] = from.y, path.x[0] = from.x;
  path.y[kParts] = to.y, path.x[kParts] = to.x;
  std::size_t draw = 1;
  std::size_t length = kParts;
  for (const Bridge& bridge : used(pole).bridges) {
    for (std::size_t i = 0; i < kParts; i += length, ++draw) {
      const auto sum = [&](const std::array<float, 6>& row) {
        return (row[0] * path.y[i] + row[1] * path.x[i]) + (row[2] * path.y[i + length] + row[3] * path.x[i + length]) +
               (row[4] * n1[draw] + row[5] * n2[draw]);
      };
      path.y[i + length / 2] = sum(bridge.y), path.x[i + length / 2] = sum(bridge.x);
    }
    length /= 2;
  }
  return path;
}

NoiseState PhotoreceptorNoise::first(std::uint32_t pixel, std::int32_t pole) const {
  // Stationary: Var y = v, Var x = Cov xy = v t1 / (t1 + t2). Draw 0 belongs to this state alone.
  const double t1 = t1_ns(pole), common = variance_ * t1 / (t1 + t2_);
  const auto n = random_.normals(pixel, 0);
  return root({variance_, common, common}).apply(n[0], n[1]);
}

NoiseState PhotoreceptorNoise::after_step(const NoiseState& from, const std::array<float, 2>& n, std::int32_t pole,
                                          float drift) const {
  const NoiseLanes d;
  const Step& step = this->step(pole);
  const auto parabola = [&](std::size_t factor, std::size_t i) { return hn::Set(d, step.parabolas[factor][i]); };
  auto y = hn::Set(d, from.y), x = hn::Set(d, from.x);
  noise_step(d, parabola, hn::Set(d, step.xx), hn::Set(d, drift), hn::Set(d, n[0]), hn::Set(d, n[1]), y, x);
  return {hn::GetLane(y), hn::GetLane(x)};
}

void PhotoreceptorNoise::draw(std::size_t count, const std::uint32_t* pixels, const std::uint32_t* first,
                              Draws& n) const {
  // Four words serve two nodes.
  alignas(64) std::array<std::uint32_t, 16> items{}, addresses{};
  for (std::size_t i = 0; i < count; ++i) items[i] = pixels[i], addresses[i] = kNodeAddresses | (first[i] >> 1);
  alignas(64) std::array<std::array<std::uint32_t, 16>, 4> words;
  random_.bits(count, items.data(), addresses.data(),
               {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  if (2 * count <= kDrawn) {  // both nodes at once
    std::copy_n(words[2].data(), count, words[0].data() + count);
    std::copy_n(words[3].data(), count, words[1].data() + count);
    alignas(64) std::array<float, 16> n1, n2;
    normals(2 * count, words[0].data(), words[1].data(), n1.data(), n2.data());
    for (std::size_t k = 0; k < kNodesDrawn; ++k) {
      std::copy_n(&n1[k * count], count, n[k][0].data());
      std::copy_n(&n2[k * count], count, n[k][1].data());
    }
    return;
  }
  for (std::size_t k = 0; k < kNodesDrawn; ++k)
    normals(count, words[2 * k].data(), words[2 * k + 1].data(), n[k][0].data(), n[k][1].data());
}

NoiseState PhotoreceptorNoise::after_gap(const NoiseState& from, const std::array<float, 2>& n, double gap,
                                         std::int32_t pole) const {
  // The closed form of added(), which is exact enough except for gaps far below the time constants.
  const double t1 = t1_ns(pole), h = std::max(gap, 1e-3 * std::min(t1, t2_));
  const double e1 = std::exp(-h / t1), e2 = std::exp(-h / t2_), gain = t1 / (t1 - t2_), power = 2 * variance_ / t1;
  const double yy = variance_ * (1 - e1 * e1), uu = gain * gain * power * t2_ / 2 * (1 - e2 * e2);
  const double cross = -gain * power * t1 * t2_ / (t1 + t2_) * (1 - e1 * e2);
  const double part = gap < h ? std::sqrt(gap / h) : 1.0;
  const NoiseState drawn = root({yy, cross + gain * yy, uu + 2 * gain * cross + gain * gain * yy})
                               .apply(part * static_cast<double>(n[0]), part * static_cast<double>(n[1]));
  const NoiseState drifted = drift(t1, t2_, gap).apply(static_cast<double>(from.y), static_cast<double>(from.x));
  return {drifted.y + drawn.y, drifted.x + drawn.x};
}

std::optional<std::pair<double, int>> NoiseCubic::first_exit(double lower, double upper) const {
  if (v0 >= upper) return std::pair{0.0, 1};
  if (v0 <= lower) return std::pair{0.0, -1};
  // v0 + c1 u + c2 u^2 + c3 u^3 in u = t / h
  const double c1 = h * s0, rise = v1 - v0;
  const double c2 = 3 * rise - h * (2 * s0 + s1), c3 = h * (s0 + s1) - 2 * rise;
  std::array<double, 3> ends{1.0, 1.0, 1.0};  // of monotone parts
  std::size_t count = 0;
  if (!(s0 * rise > 0 && s1 * rise > 0 && std::abs(s0 + s1) * h < 3 * std::abs(rise))) {
    // The extrema lie at the roots of the slope.
    const double discriminant = c2 * c2 - 3 * c1 * c3;
    if (discriminant > 0) {
      const double q = -(c2 + std::copysign(std::sqrt(discriminant), c2));
      const double r1 = c3 != 0 ? q / (3 * c3) : -1.0, r2 = q != 0 ? c1 / q : -1.0;
      for (const double root : {std::min(r1, r2), std::max(r1, r2)}) {
        if (root > 0 && root < 1) ends[count++] = root;
      }
    }
  }
  double begin = 0, at_begin = v0;
  for (std::size_t i = 0; i <= count; ++i) {
    const double end = ends[i], at_end = i == count ? v1 : v0 + end * (c1 + end * (c2 + end * c3));
    const int polarity = at_end >= upper ? 1 : at_end <= lower ? -1 : 0;
    if (polarity == 0) {
      begin = end, at_begin = at_end;
      continue;
    }
    // Newton's method, with bisection where it would leave the part that contains the root.
    const double level = polarity > 0 ? upper : lower;
    double before = begin, after = end, u = begin + (end - begin) * (level - at_begin) / (at_end - at_begin);
    for (int k = 0; k < 60; ++k) {
      const double beyond = v0 + u * (c1 + u * (c2 + u * c3)) - level, rate = c1 + u * (2 * c2 + 3 * u * c3);
      (beyond * polarity >= 0 ? after : before) = u;
      const double next = u - beyond / rate, last = u;
      u = next >= before && next <= after ? next : 0.5 * (before + after);
      if (std::abs(u - last) < kRootStep) break;
    }
    return std::pair{u * h, polarity};
  }
  return std::nullopt;
}

}  // namespace esim::inline event_camera

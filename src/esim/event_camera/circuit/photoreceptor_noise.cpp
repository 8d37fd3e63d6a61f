#include "esim/event_camera/circuit/photoreceptor_noise.h"

#include <fmt/format.h>

#include <utility>

#include "esim/core/error.h"
#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

constexpr double kPoleStep = 1.01;  // ratio of successive time constants t1
// Standard deviation of x in the middle of an interval with known ends, in deviations of x: of steps, and where x is
// taken for a cubic.
constexpr double kUnknown = 0.12, kNeglected = 0.015;
// Addresses of draws: those of steps, 8 i + j with j = 1 to 7 within steps, 0 of the first state, others above 32 bits.
constexpr std::uint32_t kStepAddresses = 0x80000000;

/// A 2 x 2 matrix that acts on (y, x).
struct NoiseMatrix {
  double yy = 0, yx = 0, xy = 0, xx = 0;

  NoiseState operator*(const NoiseState& s) const { return {yy * s.y + yx * s.x, xy * s.y + xx * s.x}; }
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
/// 31 random bits, at most 6.7. All arrays have 16 elements.
void normals(std::size_t count, const std::uint32_t* first, const std::uint32_t* second, float* n1, float* n2) {
  const hn::CappedTag<float, 16> d;
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
  for (std::size_t i = 0; i < count; ++i) {
    Pole pole;
    pole.t1 = apart(std::exp(log_first_ + static_cast<double>(i) / per_log_step_), t2_);
    pole.deviation = deviation_at(pole.t1);
    double shortest = 0.1 * std::min(pole.t1, t2_), longest = 4 * std::max(pole.t1, t2_);
    for (int k = 0; k < 30; ++k) {
      const double h = std::sqrt(shortest * longest);
      (make_bridge(pole.t1, h).deviation <= kUnknown * pole.deviation ? shortest : longest) = h;
    }
    pole.first_bridge = bridges_.size();
    const auto is_cubic = [&](double h) { return make_bridge(pole.t1, h).deviation <= kNeglected * pole.deviation; };
    while (!is_cubic(std::ldexp(shortest, -static_cast<int>(kMaxDepth)))) shortest *= 0.9;
    pole.step = shortest;
    for (double h = pole.step; !is_cubic(h); h *= 0.5, ++pole.bridges) bridges_.push_back(make_bridge(pole.t1, h));
    pole.decay = std::exp(-pole.step / t2_);
    poles_.push_back(pole);
    for (int k = -kDrifts; k <= kDrifts; ++k) {
      const double t1 = apart(pole.t1 * std::exp(kDriftStep * k), t2_);
      const NoiseMatrix moved = drift(t1, t2_, pole.step), drawn = root(added(variance_, t1, t2_, pole.step));
      steps_.push_back({moved.yy, moved.xy, drawn.yy, drawn.xy, drawn.xx});
    }
  }
}

PhotoreceptorNoise::Bridge PhotoreceptorNoise::make_bridge(double t1, double h) const {
  // Middle M = A S0 + n1, end S1 = A M + n2, n1 and n2 of covariance C. Given both ends, M has the mean
  // A S0 + K (S1 - A^2 S0) with K = C A' (A C A' + C)^-1, and the covariance C - K A C.
  const NoiseMatrix a = drift(t1, t2_, 0.5 * h), c = full(added(variance_, t1, t2_, 0.5 * h));
  const NoiseMatrix k = product(product(c, transposed(a)), inverse(full(added(variance_, t1, t2_, h))));
  const NoiseMatrix covariance = difference(c, product(product(k, a), c));
  const NoiseMatrix from = difference(a, product(k, product(a, a)));
  const NoiseMatrix spread = root({covariance.yy, 0.5 * (covariance.xy + covariance.yx), covariance.xx});
  return {{from.yy, from.yx, k.yy, k.yx, spread.yy, 0.0},
          {from.xy, from.xx, k.xy, k.xx, spread.xy, spread.xx},
          std::sqrt(std::max(covariance.xx, 0.0))};
}

void PhotoreceptorNoise::draw(Middles& middles) const {
  alignas(64) std::array<std::uint32_t, 16> items, addresses;
  items.fill(middles.pixel);
  for (std::uint32_t i = 0; i < 16; ++i) addresses[i] = (8 * middles.node + i) & ~kStepAddresses;
  alignas(64) std::array<std::array<std::uint32_t, 16>, 4> words;
  random_.bits(8, items.data(), addresses.data(), {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  normals(8, words[0].data(), words[1].data(), middles.n1.data(), middles.n2.data());
  middles.drawn = true;
}

std::pair<PhotoreceptorNoise::Part, PhotoreceptorNoise::Part> PhotoreceptorNoise::halves(std::int32_t pole,
                                                                                         const Part& part,
                                                                                         Middles& middles) const {
  if (!middles.drawn) draw(middles);
  const Bridge& bridge = bridges_[poles_[static_cast<std::size_t>(pole)].first_bridge + part.depth];
  const auto n1 = static_cast<double>(middles.n1[part.index]), n2 = static_cast<double>(middles.n2[part.index]);
  const auto sum = [&](const std::array<double, 6>& row) {
    return row[0] * part.from.y + row[1] * part.from.x + row[2] * part.to.y + row[3] * part.to.x + row[4] * n1 +
           row[5] * n2;
  };
  const NoiseState middle{sum(bridge.y), sum(bridge.x)};
  return {{part.from, middle, part.start, 2 * part.index, part.depth + 1},
          {middle, part.to, part.start + 0.5 * length(pole, part), 2 * part.index + 1, part.depth + 1}};
}

double PhotoreceptorNoise::at(std::int32_t pole, Part part, double tau, Middles& middles) const {
  while (!is_cubic(pole, part)) {
    const auto [first, second] = halves(pole, part, middles);
    part = tau < second.start ? first : second;
  }
  return cubic(pole, part).value(tau - part.start);
}

NoiseState PhotoreceptorNoise::first(std::uint32_t pixel, std::int32_t pole) const {
  // Stationary: Var y = v, Var x = Cov xy = v t1 / (t1 + t2). Draw 0 belongs to this state alone.
  const double t1 = poles_[static_cast<std::size_t>(pole)].t1, common = variance_ * t1 / (t1 + t2_);
  const auto n = random_.normals(pixel, 0);
  return root({variance_, common, common}) * NoiseState{n[0], n[1]};
}

NoiseState PhotoreceptorNoise::after_step(const NoiseState& from, const std::array<float, 2>& n, std::int32_t pole,
                                          double drift) const {
  const double place = drift + kDrifts, below = std::clamp(std::floor(place), 0.0, 2.0 * kDrifts - 1);
  const Step* const step = steps(pole) + static_cast<std::size_t>(below);
  const auto at = [&](double Step::*value) {
    return step[0].*value + (place - below) * (step[1].*value - step[0].*value);
  };
  const auto n1 = static_cast<double>(n[0]), n2 = static_cast<double>(n[1]);
  return {at(&Step::yy) * from.y + at(&Step::n_yy) * n1,
          at(&Step::xy) * from.y + decay(pole) * from.x + at(&Step::n_xy) * n1 + at(&Step::n_xx) * n2};
}

void PhotoreceptorNoise::draw(std::size_t count, const std::uint32_t* pixels, const std::uint32_t* first,
                              Draws& n) const {
  // Four words serve two nodes. Words of the nodes first and first + 1 of all pixels come before those of the next two.
  constexpr std::size_t kWords = 2 * kDrawn;
  alignas(64) std::array<std::uint32_t, kWords> items{}, addresses{};
  for (std::size_t i = 0; i < count; ++i) {
    items[i] = items[count + i] = pixels[i];
    addresses[i] = kStepAddresses | (first[i] >> 1);
    addresses[count + i] = addresses[i] + 1;
  }
  alignas(64) std::array<std::array<std::uint32_t, kWords>, 4> words;
  random_.bits(2 * count, items.data(), addresses.data(),
               {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  alignas(64) std::array<float, kWords> cosines, sines;
  for (std::size_t parity = 0; parity < 2; ++parity) {
    normals(2 * count, words[2 * parity].data(), words[2 * parity + 1].data(), cosines.data(), sines.data());
    for (std::size_t half = 0; half < 2; ++half) {
      std::copy_n(&cosines[half * count], count, n[2 * half + parity][0].begin());
      std::copy_n(&sines[half * count], count, n[2 * half + parity][1].begin());
    }
  }
}

NoiseState PhotoreceptorNoise::after_gap(const NoiseState& from, double gap, std::uint32_t pixel, std::uint32_t node,
                                         std::int32_t pole) const {
  // The closed form of added(), which is exact enough except for gaps far below the time constants.
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
    for (int k = 0; k < 6; ++k) {
      const double centre = 0.5 * (before + after), here = value(centre);
      (polarity > 0 ? here >= upper : here <= lower) ? after = centre : before = centre;
    }
    // Newton's method, so that the time hardly depends on where the search began.
    double t = 0.5 * (before + after);
    for (int k = 0; k < 8; ++k) {
      const double rate = slope(t);
      if (rate * polarity <= 0) return std::pair{after, polarity};
      const double last = std::exchange(t, std::clamp(t - (value(t) - level) / rate, before, after));
      if (std::abs(t - last) < 1e-9 * h) break;
    }
    return std::pair{t, polarity};
  }
  return std::nullopt;
}

}  // namespace esim::inline event_camera

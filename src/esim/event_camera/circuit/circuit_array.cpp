#include "esim/event_camera/circuit/circuit_array.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/random.h"
#include "esim/core/vector_math.h"
#include "esim/event_camera/noise_rate.h"

namespace esim::inline event_camera {
namespace {

constexpr double kElectron_fC = 1.602176634e-4;  // elementary charge, fA s
constexpr double kSettled = 1e-13;               // brightness: differences below this are zero
constexpr float kUnreachable = 1e6F;             // threshold of a dead pixel
constexpr double kGuard = 1e-9;                  // between bounds and levels, above all rounding errors
// Irradiance is rounded to multiples of 1 / (2 kPerLight) where it is summed over time, so that sums over whole ns are
// exact, however a stretch of constant light is cut.
constexpr double kPerLight = 4096;

}  // namespace

/// A row of a segment's tile, from the tile's first pixel on.
struct CircuitArray::Row {
  const float *light0, *light1;  // irradiance at both ends
  std::size_t first;             // pixel
  int y, x;
  std::size_t count;
  TimeNs t0;
  double start, length;  // ns after the epoch; ns
  EventPacking packing;
};

CircuitArray::CircuitArray(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                           std::uint16_t stream)
    : width_(width), height_(height), starts_(seed, Purpose::circuit_start, stream) {
  const CircuitOptions& o = *options.circuit;
  const double white_fa = o.white_photocurrent_fa();
  dark_ = o.dark_current_fa / white_fa;
  circuit_.poles.t1_unit_ns = 1e9 * o.photodiode_charge_e * kElectron_fC / white_fa;
  circuit_.waits = options.readout.acknowledges();
  circuit_.poles.t2_ns = 1e9 / (2 * std::numbers::pi * o.source_follower_hz);
  circuit_.poles.high_pass_per_ns = 1e-9 * 2 * std::numbers::pi * o.high_pass_hz;
  if (o.noise > 0) {
    constexpr double kBrightest = 1e5;  // irradiance; brighter light has the same time constant for the noise
    circuit_.noise.emplace(o.noise * o.noise / o.photodiode_charge_e, circuit_.poles.t2_ns,
                           circuit_.poles.t1_unit_ns / std::max(kBrightest, 10 * dark_),
                           circuit_.poles.t1_unit_ns / dark_, AddressedRandom(seed, Purpose::circuit_noise, stream));
  }
  make_pixels(options, seed, stream);
}

void CircuitArray::make_pixels(const EventCameraOptions& options, std::uint64_t seed, std::uint16_t stream) {
  const CircuitOptions& o = *options.circuit;
  const std::size_t count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  parameters_.resize(count);
  states_.resize(count);
  for (auto* values : {&light_, &lag_, &y_, &v_, &low_, &high_, &until_}) values->resize(count + kVectorPadding);
  node_light_.resize(count + kVectorPadding);
  leak_.resize(count + kVectorPadding);
  if (o.high_pass_hz > 0) w_.resize(count + kVectorPadding);
  if (o.leak_hz_per_klux > 0) light_sum_.resize(count + kVectorPadding), light_leak_.resize(count + kVectorPadding);
  if (options.labels) origins_.resize(count), hot_.resize(count);
  const AddressedRandom random(seed, Purpose::circuit_mismatch, stream);
  const double refractory_ns = 1e3 * options.refractory_period_us, max_rate = max_rate_hz(options);
  limits_ = std::isfinite(max_rate);
  const double min_interval_ns = 1e9 / max_rate;
  for (std::size_t i = 0; i < count; ++i) {
    const auto pixel = static_cast<std::uint32_t>(i);
    const auto [common, on] = random.normals(pixel, 0);
    const auto [off, noise] = random.normals(pixel, 1);
    const auto [leak, refractory] = random.normals(pixel, 2);
    const auto [hot, sign] = random.uniforms(pixel, 3);
    const auto [dead, ignored] = random.uniforms(pixel, 5);
    const auto [hot_decades, unused] = random.normals(pixel, 4);
    static_cast<void>(unused), static_cast<void>(ignored);
    const auto threshold = [&, both = common](double mean, double own) {  // clang 14 does not capture `common` itself
      return std::max(mean * (1 + o.threshold_mismatch_common * both) + options.threshold_mismatch * own,
                      std::max(kMinContrastThreshold, 0.2 * mean));
    };
    CircuitParameters& p = parameters_[i];
    p.on = static_cast<float>(threshold(options.threshold_on(), on));
    p.off = static_cast<float>(threshold(options.threshold_off(), off));
    if (dead < options.dead_pixels) p.on = p.off = kUnreachable;
    p.noise = static_cast<float>(std::pow(10.0, o.noise_mismatch_decades * noise));
    p.refractory = static_cast<float>(
        std::max(min_interval_ns, refractory_ns * std::pow(10.0, o.refractory_mismatch_decades * refractory)));
    const double leak_unit = options.threshold_on() * std::pow(10.0, options.leak_mismatch_decades * leak);
    double rate = options.leak_rate_hz * leak_unit;
    if (!light_leak_.empty()) {
      light_leak_[i] = static_cast<float>(1e-3 * o.leak_hz_per_klux * o.white_sensor_lux() * leak_unit);
    }
    if (hot < options.hot_pixels) {
      rate += options.hot_pixel_rate_hz * options.threshold_on() *
              std::pow(10.0, o.hot_mismatch_decades * hot_decades) * (sign < o.hot_off_fraction ? -1 : 1);
    }
    if (options.labels) hot_[i] = hot < options.hot_pixels;
    leak_[i] = static_cast<float>(rate);
    until_[i] = -1;
  }
}

bool CircuitArray::open(const Segment& segment, Rows rows) {
  const auto width = static_cast<std::size_t>(segment.tile.width);
  for (int y = rows.first; y < rows.last; ++y) {
    const float* const irradiance = segment.irradiance1.row(y) + segment.tile.x;
    for (std::size_t x = 0; x < width; ++x) {
      if (!(irradiance[x] >= 0 && irradiance[x] <= std::numeric_limits<float>::max())) return false;
    }
  }
  for (int y = rows.first; y < rows.last; ++y) {
    const float* const irradiance = segment.irradiance1.row(y) + segment.tile.x;
    const std::size_t first =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(segment.tile.x);
    std::vector<double> lights(width + kVectorPadding, 1.0);
    for (std::size_t x = 0; x < width; ++x) lights[x] = static_cast<double>(irradiance[x]) + dark_;
    logarithms(width, lights.data());
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = first + x;
      light_[i] = y_[i] = v_[i] = lights[x];
      lag_[i] = 0;
      if (!w_.empty()) w_[i] = v_[i];
      const double place = starts_.uniforms(static_cast<std::uint32_t>(i), 0)[0];
      const auto time = static_cast<double>(segment.t1 - epoch_);
      const double light_rate = std::round(2 * kPerLight * static_cast<double>(irradiance[x]));
      pixel(i).open(lights[x], w_.empty() ? v_[i] : 0.0, leak(i, light_rate, time), time, place);
      until_[i] = -1;  // looks at once
    }
  }
  return true;
}

/// Solves the front end of some neighbouring pixels as advance() does in one step, and adds those to
/// buffer.uncertain that need more steps, or whose pixels may fire.
template <class D>
HWY_INLINE bool CircuitArray::move_vector(D d, const Row& row, std::size_t x, CircuitBuffer& buffer, std::size_t at) {
  using V = hn::Vec<D>;
  const hn::Rebind<float, D> df;
  const auto set = [d](double value) { return hn::Set(d, value); };
  const V one = set(1), length = set(row.length), dark = set(dark_);
  const std::size_t i = row.first + x;
  const auto irradiance = [&](const float* values) {
    if (x + hn::Lanes(d) <= row.count) return hn::Add(hn::PromoteTo(d, hn::LoadU(df, values + x)), dark);
    std::array<float, kVectorPadding> last{};  // nothing may lie behind the last pixel of an image
    std::copy(values + x, values + row.count, last.begin());
    return hn::Add(hn::PromoteTo(d, hn::LoadU(df, last.data())), dark);
  };
  const V e0 = irradiance(row.light0), e1 = irradiance(row.light1);
  const V light0 = hn::LoadU(d, &light_[i]), lag0 = hn::LoadU(d, &lag_[i]), y0 = hn::LoadU(d, &y_[i]),
          v0 = hn::LoadU(d, &v_[i]);

  const bool high_pass = !w_.empty();
  const V w0 = high_pass ? hn::LoadU(d, &w_[i]) : hn::Zero(d), in0 = hn::Sub(v0, w0);  // in: into the comparators

  V light1 = light0, lag1 = lag0, y1 = y0, v1 = v0, w1 = w0, lowest = in0, highest = in0;
  V level = in0, slope = hn::Zero(d), fast = slope, slow = slope, passed = slope, k1 = one;
  auto several = hn::FirstN(d, 0);
  auto still = hn::And(hn::And(hn::Eq(e0, e1), hn::Eq(lag0, hn::Zero(d))), hn::Eq(v0, y0));
  if (high_pass) still = hn::And(still, hn::Eq(v0, w0));
  if (!hn::AllTrue(d, still)) {
    light1 = hn::Log(d, e1);
    const V growth = hn::Sub(light1, light0), rho = hn::Div(hn::Sub(e1, e0), e0);
    const V rate0 = hn::Mul(e0, set(1 / circuit_.poles.t1_unit_ns));
    const auto changes = hn::Ne(growth, hn::Zero(d));
    const V mean_over_first = hn::IfThenElse(changes, hn::Div(rho, hn::IfThenElse(changes, growth, one)), one);
    const V area = hn::Mul(hn::Mul(rate0, length), mean_over_first);
    several =
        hn::Or(hn::Gt(hn::Abs(growth), set(kMaxLightStep)),
               hn::And(hn::Gt(hn::Abs(hn::Sub(lag0, hn::Div(growth, hn::Mul(rate0, length)))), set(kMaxTransient)),
                       hn::Gt(area, set(kMaxDecay))));

    // exponential_moments()
    const V safe = hn::Max(area, set(1e-9)), inverse = hn::Div(one, safe);
    const V up0 = hn::Mul(hn::Sub(one, hn::Exp(d, hn::Neg(safe))), inverse);
    const V up1 = hn::Mul(hn::Sub(one, up0), inverse), up2 = hn::Mul(hn::NegMulAdd(set(2), up1, one), inverse);
    const V up3 = hn::Mul(hn::NegMulAdd(set(3), up2, one), inverse);
    const V low_area = hn::Min(area, set(2));
    V down3 = one;
    for (int j = 18; j >= 1; --j) down3 = hn::NegMulAdd(hn::Mul(low_area, set(1.0 / (4 + j))), down3, one);
    down3 = hn::Mul(down3, set(0.25));
    const V down2 = hn::Mul(hn::NegMulAdd(low_area, down3, one), set(1.0 / 3));
    const V down1 = hn::Mul(hn::NegMulAdd(low_area, down2, one), set(0.5)), down0 = hn::NegMulAdd(low_area, down1, one);
    const auto large = hn::Gt(area, set(2));
    const V p0 = hn::IfThenElse(large, up0, down0), p1 = hn::IfThenElse(large, up1, down1),
            p2 = hn::IfThenElse(large, up2, down2), p3 = hn::IfThenElse(large, up3, down3);
    const V decay = hn::NegMulAdd(area, p0, one);

    const auto quotient = [&](double part) {
      const V g = hn::MulAdd(rho, set(part), one);
      return hn::Div(one, hn::Mul(g, g));
    };
    const V f1 = quotient(1.0 / 3), f2 = quotient(2.0 / 3), f3 = quotient(1.0);
    const auto sum = [&](double a, double b, double c, double e) {
      return hn::MulAdd(set(b), f1, hn::MulAdd(set(c), f2, hn::MulAdd(set(e), f3, set(a))));
    };
    const V c1 = sum(-5.5, 9, -4.5, 1), c2 = sum(9, -22.5, 18, -4.5), c3 = sum(-4.5, 13.5, -13.5, 4.5);
    const V integral = hn::MulAdd(c3, p3, hn::MulAdd(c2, p2, hn::MulAdd(c1, p1, p0)));
    const V grown = hn::Add(one, rho);
    lag1 = hn::Mul(grown, hn::MulAdd(lag0, decay, hn::Mul(rho, integral)));
    lag1 = hn::IfThenElse(hn::Lt(hn::Abs(lag1), set(kSettled)), hn::Zero(d), lag1);
    y1 = hn::Sub(light1, hn::Log1p(d, lag1));

    // The piece
    const V slope0 = hn::Div(hn::Mul(rate0, lag0), hn::Add(one, lag0));
    const V a_plain = hn::Max(area, set(1e-3));
    const V per_length = set(1 / row.length);
    k1 = hn::Mul(a_plain, per_length);
    const V t2 = set(circuit_.poles.t2_ns);
    auto resonates = hn::Lt(hn::Abs(hn::MulSub(k1, t2, one)), set(0.005));
    k1 = hn::IfThenElse(resonates, set(1.005 / circuit_.poles.t2_ns), k1);
    const double k_3 = circuit_.poles.high_pass_per_ns;
    if (high_pass) {
      const auto resonates3 = hn::Lt(hn::Abs(hn::Sub(k1, set(k_3))), set(0.005 * k_3));
      k1 = hn::IfThenElse(resonates3, set(1.005 * k_3), k1);
      resonates = hn::Or(resonates, resonates3);
    }
    const V a = hn::Mul(k1, length);
    const auto exact = hn::And(hn::Eq(a_plain, area), hn::Not(resonates));
    const V e_k = hn::IfThenElse(exact, decay, hn::Exp(d, hn::Neg(a)));
    const V mean_decay = hn::Div(hn::Sub(one, e_k), a);
    slope = hn::Div(hn::NegMulAdd(slope0, mean_decay, hn::Mul(hn::Sub(y1, y0), per_length)), hn::Sub(one, mean_decay));
    const V gap = hn::Div(hn::Sub(slope, slope0), k1);
    level = hn::Sub(hn::Sub(y0, gap), hn::Mul(slope, t2));
    fast = hn::Div(gap, hn::NegMulAdd(k1, t2, one));
    slow = hn::Sub(hn::Sub(v0, level), fast);
    const double e_2 = std::exp(-row.length / circuit_.poles.t2_ns), k_2 = 1 / circuit_.poles.t2_ns;
    v1 = hn::MulAdd(slow, set(e_2), hn::MulAdd(fast, e_k, hn::MulAdd(slope, length, level)));
    const auto settles =
        hn::And(hn::And(hn::Eq(lag1, hn::Zero(d)), hn::Eq(e0, e1)), hn::Lt(hn::Abs(hn::Sub(v1, y1)), set(kSettled)));
    v1 = hn::IfThenElse(settles, y1, v1);
    V in1 = v1;
    if (high_pass) {  // as high_passed()
      level = hn::Div(slope, set(k_3));
      slope = hn::Zero(d);
      fast = hn::Div(hn::Mul(fast, k1), hn::Sub(k1, set(k_3)));
      slow = hn::Mul(slow, set(k_2 / (k_2 - k_3)));
      passed = hn::Sub(hn::Sub(hn::Sub(in0, level), fast), slow);
      in1 = hn::MulAdd(passed, set(std::exp(-k_3 * row.length)),
                       hn::MulAdd(slow, set(e_2), hn::MulAdd(fast, e_k, level)));
      w1 = hn::Sub(v1, in1);
      w1 = hn::IfThenElse(hn::And(settles, hn::Lt(hn::Abs(in1), set(kSettled))), v1, w1);
    }

    const V size_fast = hn::Abs(fast), size_slow = hn::Abs(slow), size_passed = hn::Abs(passed);
    V curvature = hn::MulAdd(hn::Mul(size_fast, k1), k1, hn::Mul(size_slow, set(k_2 * k_2)));
    curvature = hn::MulAdd(size_passed, set(k_3 * k_3), curvature);
    const V beyond = hn::Min(hn::Mul(curvature, set(0.125 * row.length * row.length)),
                             hn::Add(hn::Add(size_fast, size_slow), size_passed));
    lowest = hn::Sub(hn::Min(in0, in1), beyond);
    highest = hn::Add(hn::Max(in0, in1), beyond);
  }
  hn::StoreU(light1, d, &buffer.light[at]);
  hn::StoreU(lag1, d, &buffer.lag[at]);
  hn::StoreU(y1, d, &buffer.y[at]);
  hn::StoreU(v1, d, &buffer.v[at]);
  if (high_pass) hn::StoreU(w1, d, &buffer.w[at]);

  const V leak = hn::Mul(hn::PromoteTo(d, hn::LoadU(df, &leak_[i])), set(1e-9));
  V leaked0 = hn::Mul(leak, set(row.start)), leaked1 = hn::Mul(leak, set(row.start + row.length));
  if (!light_leak_.empty()) {
    const V light_leak = hn::Mul(hn::PromoteTo(d, hn::LoadU(df, &light_leak_[i])), set(0.5e-9 / kPerLight));
    const V rounded = hn::Round(hn::Mul(hn::Sub(hn::Sub(hn::Add(e0, e1), dark), dark), set(kPerLight)));
    const V sum0 = hn::LoadU(d, &light_sum_[i]), sum1 = hn::MulAdd(rounded, length, sum0);
    leaked0 = hn::MulAdd(light_leak, sum0, leaked0);
    leaked1 = hn::MulAdd(light_leak, sum1, leaked1);
    hn::StoreU(sum1, d, &buffer.light_sum[at]);
  }
  const V node_light = hn::PromoteTo(d, hn::LoadU(df, &node_light_[i]));
  const V guard = set(kGuard);
  auto uncertain = hn::Or(several, hn::Le(hn::LoadU(d, &until_[i]), set(row.start + row.length)));
  uncertain =
      hn::Or(uncertain, hn::Le(hn::Sub(hn::Add(lowest, hn::Min(leaked0, leaked1)), guard), hn::LoadU(d, &low_[i])));
  uncertain =
      hn::Or(uncertain, hn::Ge(hn::Add(hn::Add(highest, hn::Max(leaked0, leaked1)), guard), hn::LoadU(d, &high_[i])));
  uncertain = hn::Or(uncertain, hn::Ge(hn::Abs(hn::Sub(light1, node_light)), set(kLightReach)));
  const std::size_t lanes = std::min(hn::Lanes(d), row.count - x);
  const hn::RebindToUnsigned<D> du;
  alignas(64) std::array<std::uint64_t, 16> flags;
  hn::StoreU(hn::BitCast(du, hn::VecFromMask(d, uncertain)), du, flags.data());
  if (hn::AllFalse(d, uncertain)) return false;
  hn::StoreU(level, d, &buffer.level[at]);
  hn::StoreU(slope, d, &buffer.rate[at]);
  hn::StoreU(fast, d, &buffer.fast[at]);
  hn::StoreU(slow, d, &buffer.slow[at]);
  hn::StoreU(k1, d, &buffer.k1[at]);
  hn::StoreU(passed, d, &buffer.passed[at]);
  hn::StoreU(hn::IfThenElseZero(several, one), d, &buffer.several[at]);
  for (std::size_t k = 0; k < lanes; ++k) {
    if (flags[k] != 0) buffer.uncertain.push_back(static_cast<std::uint32_t>(x + k));
  }
  return true;
}

void CircuitArray::set_bounds(std::size_t pixel, const CircuitBounds& bounds) {
  const double reference = states_[pixel].reference;
  low_[pixel] = reference + bounds.low;
  high_[pixel] = reference + bounds.high;
  until_[pixel] = bounds.until;
  node_light_[pixel] = states_[pixel].node_light;
}

CircuitPixel CircuitArray::pixel(std::size_t i) {
  CircuitPixel pixel(circuit_, static_cast<std::uint32_t>(i), parameters_[i], states_[i]);
  if (!origins_.empty()) pixel.explain(&origins_[i]);
  return pixel;
}

/// The leak of a pixel on a stretch that begins at `start`, in ns after the epoch. `light_rate` is that of light_sum_.
LeakRamp CircuitArray::leak(std::size_t i, double light_rate, double start) const {
  LeakRamp leak{1e-9 * static_cast<double>(leak_[i]) * start, 1e-9 * static_cast<double>(leak_[i])};
  if (!light_leak_.empty()) {
    const double per_sum = 0.5e-9 / kPerLight * static_cast<double>(light_leak_[i]);
    leak.leaked += per_sum * light_sum_[i];
    leak.rate += per_sum * light_rate;
  }
  return leak;
}

/// Adds the label of the last event of a pixel.
void CircuitArray::label(std::size_t i, TimeNs t, int polarity, std::vector<NewLabel>& labels) const {
  const CircuitOrigin& parts = origins_[i];
  labels.push_back({t,
                    t,
                    static_cast<std::uint32_t>(i),
                    parts.signal,
                    parts.noise,
                    parts.leak,
                    static_cast<std::int8_t>(polarity),
                    0,
                    {}});
}

/// Takes a pixel to the segment's end in as many steps as needed. Calls emit(t, polarity) for each event, t in whole ns
/// after the segment's start.
template <typename Emit>
void CircuitArray::advance_one(const Row& row, std::uint32_t column, std::size_t at, CircuitBuffer& buffer,
                               const Emit& emit_event) {
  const std::size_t i = row.first + column;
  const auto emit = [&](double t, int polarity) {
    const double time = std::clamp(std::ceil(t - row.start), 0.0, row.length);
    emit_event(time, polarity);
    if (!origins_.empty()) label(i, row.t0 + static_cast<TimeNs>(time), polarity, buffer.labels);
  };
  const double light1 = buffer.light[at];
  const LightRamp ramp{light_[i], (light1 - light_[i]) / row.length};
  const double light_rate = light_leak_.empty() ? 0.0 : (buffer.light_sum[at] - light_sum_[i]) / row.length;
  const LeakRamp leak = this->leak(i, light_rate, row.start);
  if (buffer.several[at] == 0) {
    const CircuitPiece piece{buffer.level[at], buffer.rate[at],   buffer.fast[at],
                             buffer.slow[at],  buffer.k1[at],     1 / circuit_.poles.t2_ns,
                             row.length,       buffer.passed[at], circuit_.poles.high_pass_per_ns};
    CircuitPixel pixel = this->pixel(i);
    pixel.set(piece, ramp, leak, row.start);
    set_bounds(i, pixel.run(emit));
    buffer.lost += limits_ ? pixel.lost() : 0;
    keep(i, at, buffer);
    return;
  }
  CircuitState front{lag_[i], v_[i], w_.empty() ? 0.0 : w_[i]};
  buffer.lost += run(i, front, ramp, leak, row.start, row.length, emit);
  buffer.lag[at] = std::abs(front.lag) < kSettled ? 0.0 : front.lag;
  buffer.y[at] = light1 - std::log1p(buffer.lag[at]);
  const bool settles = buffer.lag[at] == 0 && ramp.rate == 0 && std::abs(front.v - buffer.y[at]) < kSettled;
  buffer.v[at] = settles ? buffer.y[at] : front.v;
  buffer.w[at] = settles && std::abs(front.v - front.w) < kSettled ? buffer.v[at] : front.w;
  keep(i, at, buffer);
}

/// Takes the front end of a pixel to the end of the segment.
void CircuitArray::keep(std::size_t i, std::size_t at, const CircuitBuffer& buffer) {
  light_[i] = buffer.light[at], lag_[i] = buffer.lag[at], y_[i] = buffer.y[at], v_[i] = buffer.v[at];
  if (!w_.empty()) w_[i] = buffer.w[at];
  if (!light_leak_.empty()) light_sum_[i] = buffer.light_sum[at];
}

/// Takes a pixel along a ramp of light, in as many steps as needed; skips those within its bounds.
/// Returns the number of events that a maximum rate has lost.
template <typename Emit>
std::int64_t CircuitArray::run(std::size_t i, CircuitState& front, const LightRamp& ramp, const LeakRamp& leak,
                               double start, double length, const Emit& emit) {
  std::int64_t lost = 0;
  CircuitPixel pixel = this->pixel(i);
  for (double done = 0; done < length;) {
    const LightRamp part{ramp.light + ramp.rate * done, ramp.rate};
    const double h = step_length(circuit_.poles, front, part, length - done), from = start + done;
    const CircuitPiece piece = esim::advance(circuit_.poles, front, part, h);
    done = h < length - done ? done + h : length;
    const auto [lowest, highest] = piece.range(0, h);
    const LeakRamp leak_here{leak.leaked + leak.rate * (from - start), leak.rate};
    const double leaked0 = leak_here.leaked, leaked1 = leaked0 + leak.rate * h;
    const double change = part.light + part.rate * h - static_cast<double>(node_light_[i]);
    const bool quiet = lowest + std::min(leaked0, leaked1) - kGuard > low_[i] &&
                       highest + std::max(leaked0, leaked1) + kGuard < high_[i] && from + h < until_[i] &&
                       std::abs(change) < kLightReach;
    if (quiet) continue;
    pixel.set(piece, part, leak_here, from);
    set_bounds(i, pixel.run(emit));
    lost += limits_ ? pixel.lost() : 0;
  }
  return lost;
}

TimeNs CircuitArray::acknowledge(std::uint32_t pixel, TimeNs t) {
  CircuitPixelState& state = states_[pixel];
  state.held_until = static_cast<double>(t - epoch_) + static_cast<double>(parameters_[pixel].refractory);
  until_[pixel] = state.held_until;
  return epoch_ + static_cast<TimeNs>(std::ceil(state.held_until));
}

/// As advance(), from the pixel's state at the start of the segment.
void CircuitArray::resume(std::uint32_t pixel, const PastSegment& past, CircuitBuffer& buffer,
                          std::vector<Event>& requests) {
  const Segment& segment = past.segment;
  const int x = static_cast<int>(pixel) % width_, y = static_cast<int>(pixel) / width_;
  const int column = x - segment.tile.x, line = y - segment.tile.y;
  const Row row{segment.irradiance0.row(y) + x,
                segment.irradiance1.row(y) + x,
                pixel,
                y,
                x,
                1,
                segment.t0,
                static_cast<double>(segment.t0 - epoch_),
                static_cast<double>(segment.t1 - segment.t0),
                EventPacking(width_, height_)};
  std::array<double, 6> present{};
  std::size_t used = 0;
  for (auto* const values : front()) {
    if (values->empty()) continue;
    present[used] = (*values)[pixel];
    (*values)[pixel] = past.front[used++](column, line);
  }
  buffer.uncertain.clear();
  const auto emit = [&](double time, int polarity) {
    requests.push_back({row.t0 + static_cast<TimeNs>(time), static_cast<std::uint16_t>(x),
                        static_cast<std::uint16_t>(y), static_cast<std::int8_t>(polarity)});
  };
  if (move_vector(hn::ScalableTag<double>(), row, 0, buffer, 0) && !buffer.uncertain.empty())
    advance_one(row, 0, 0, buffer, emit);
  used = 0;
  for (auto* const values : front()) {
    if (!values->empty()) (*values)[pixel] = present[used++];
  }
}

void CircuitArray::flush(const Row& row, CircuitBuffer& buffer, PackedEvents& events) {
  events.add(buffer.events, row.t0, buffer.time.data(), buffer.place.data(), buffer.polarity.data(),
             buffer.reported.data());
  buffer.events = 0;
}

bool CircuitArray::advance(const Segment& segment, Rows rows, CircuitBuffer& buffer, PastSegment* past,
                           PackedEvents& events) {
  const hn::ScalableTag<double> d;
  const hn::ScalableTag<float> df;
  const auto width = static_cast<std::size_t>(segment.tile.width);
  IrradianceCheck check(df);
  for (int y = rows.first; y < rows.last; ++y) {
    const float* const light1 = segment.irradiance1.row(y) + segment.tile.x;
    std::size_t x = 0;
    for (; x + hn::Lanes(df) <= width; x += hn::Lanes(df)) check.see(df, hn::LoadU(df, light1 + x));
    for (; x < width; ++x) check.see(df, hn::Set(df, light1[x]));
  }
  if (!check.passed()) return false;
  for (int y = rows.first; y < rows.last; ++y) {
    const std::size_t first =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(segment.tile.x);
    const Row row{segment.irradiance0.row(y) + segment.tile.x,
                  segment.irradiance1.row(y) + segment.tile.x,
                  first,
                  y,
                  segment.tile.x,
                  width,
                  segment.t0,
                  static_cast<double>(segment.t0 - epoch_),
                  static_cast<double>(segment.t1 - segment.t0),
                  events.packing()};
    if (past != nullptr) {
      std::size_t used = 0;
      for (const auto* const values : front()) {
        if (!values->empty()) std::copy_n(&(*values)[first], width, past->front[used++].row(y - segment.tile.y));
      }
    }
    for (std::size_t begin = 0; begin < width; begin += CircuitBuffer::kTogether) {
      const std::size_t count = std::min(CircuitBuffer::kTogether, width - begin);
      buffer.uncertain.clear();
      for (std::size_t x = 0; x < count; x += hn::Lanes(d)) move_vector(d, row, begin + x, buffer, x);
      // Uncertain pixels start from the state before the segment.
      std::size_t next = 0;
      for (std::size_t x = 0; x < count; ++x) {
        if (next < buffer.uncertain.size() && buffer.uncertain[next] == begin + x) {
          ++next;
          continue;
        }
        keep(first + begin + x, x, buffer);
      }
      for (const std::uint32_t column : buffer.uncertain) {
        const auto place = static_cast<std::uint32_t>(row.packing.place(row.x + static_cast<int>(column), row.y));
        advance_one(row, column, column - begin, buffer, [&](double time, int polarity) {
          if (buffer.events == kBlock) flush(row, buffer, events);
          const std::size_t n = buffer.events++;
          buffer.time[n] = time, buffer.polarity[n] = polarity, buffer.reported[n] = 1, buffer.place[n] = place;
        });
      }
    }
    flush(row, buffer, events);
  }
  return true;
}

}  // namespace esim::inline event_camera

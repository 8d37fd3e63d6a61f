#include "esim/event_camera/circuit/circuit_array.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "esim/core/random.h"
#include "esim/core/vector_math.h"
#include "esim/event_camera/circuit/photoreceptor_vectors.h"
#include "esim/event_camera/noise_rate.h"

namespace esim::inline event_camera {
namespace {

constexpr float kUnreachable = 1e6F;  // threshold of a dead pixel
// Irradiance is rounded to multiples of 1 / (2 kPerLight) where it is summed over time, so that sums over whole ns are
// exact, however a stretch of constant light is cut.
constexpr double kPerLight = 4096;

}  // namespace

CircuitArray::CircuitArray(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                           std::uint16_t stream)
    : width_(width), height_(height), starts_(seed, Purpose::circuit_start, stream), coupling_(*options.circuit) {
  const CircuitOptions& o = *options.circuit;
  const double white_fa = o.white_photocurrent_fa();
  dark_ = o.dark_current_fa / white_fa;
  circuit_.poles.t1_unit_ns = 1e9 * o.photodiode_charge_e * CircuitOptions::kElementaryCharge_fC / white_fa;
  circuit_.log_t1_unit = std::log(circuit_.poles.t1_unit_ns);
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
      KnownPath unused;
      pixel(i, unused).open(lights[x], w_.empty() ? v_[i] : 0.0, leak(i, light_rate, time), time, place);
      until_[i] = -1;  // looks at once
    }
  }
  return true;
}

/// Solves the front end of some neighbouring pixels as advance() does in one step. Puts those into the buffer that need
/// more steps, or may fire, and takes the others to the segment's end.
template <class D>
HWY_INLINE void CircuitArray::move_vector(D d, const Row& row, std::size_t x, CircuitBuffer& buffer, std::size_t at) {
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
  CircuitStates<D> state{hn::LoadU(d, &light_[i]), hn::LoadU(d, &lag_[i]), hn::LoadU(d, &y_[i]), hn::LoadU(d, &v_[i]),
                         w_.empty() ? hn::Zero(d) : hn::LoadU(d, &w_[i])};

  const V in0 = hn::Sub(state.v, state.w);  // into the comparators
  V lowest = in0, highest = in0;
  CircuitPieces<D> piece{in0, hn::Zero(d), hn::Zero(d), hn::Zero(d), one, hn::Zero(d)};
  auto several = hn::FirstN(d, 0);
  auto still = hn::And(hn::And(hn::Eq(e0, e1), hn::Eq(state.lag, hn::Zero(d))), hn::Eq(state.v, state.y));
  if (!w_.empty()) still = hn::And(still, hn::Eq(state.v, state.w));
  if (!hn::AllTrue(d, still)) {
    const double t2 = circuit_.poles.t2_ns, k3 = circuit_.poles.high_pass_per_ns;
    CircuitRamps<D> ramp;
    ramp.light1 = hn::Log(d, e1);
    ramp.growth = hn::Sub(ramp.light1, state.light), ramp.rho = hn::Div(hn::Sub(e1, e0), e0);
    ramp.rate0 = hn::Mul(e0, set(1 / circuit_.poles.t1_unit_ns));
    ramp.length = length;
    ramp.decay2 = set(std::exp(-row.length / t2)), ramp.decay3 = set(std::exp(-k3 * row.length));
    const V area = area_of(d, ramp);
    // As in step_length(), multiplied by the length over Q / I, so that nothing is divided
    const V decays = hn::Mul(area, set(1 / kMaxDecay)), decays2 = hn::Mul(decays, decays);
    const V per_transient = hn::Mul(ramp.rate0, length);
    const V transient = hn::Abs(hn::MulSub(state.lag, per_transient, ramp.growth));
    const auto is_long =
        hn::And(hn::Gt(decays, one), hn::Gt(hn::Mul(hn::Mul(decays2, decays2), transient), per_transient));
    several = hn::Or(hn::Gt(hn::Abs(ramp.growth), set(kMaxLightStep)),
                     hn::And(hn::Gt(transient, hn::Mul(per_transient, set(kMaxTransient))), is_long));
    piece = esim::advance(d, circuit_.poles, ramp, area, state);

    const V size_fast = hn::Abs(piece.fast), size_slow = hn::Abs(piece.slow), size_passed = hn::Abs(piece.passed);
    V curvature = hn::MulAdd(hn::Mul(size_fast, piece.k1), piece.k1, hn::Mul(size_slow, set(1 / (t2 * t2))));
    curvature = hn::MulAdd(size_passed, set(k3 * k3), curvature);
    const V beyond = hn::Min(hn::Mul(curvature, set(0.125 * row.length * row.length)),
                             hn::Add(hn::Add(size_fast, size_slow), size_passed));
    const V in1 = hn::Sub(state.v, state.w);
    lowest = hn::Sub(hn::Min(in0, in1), beyond);
    highest = hn::Add(hn::Max(in0, in1), beyond);
  }
  V light_sum = hn::Zero(d);
  const V leak = hn::Mul(hn::PromoteTo(d, hn::LoadU(df, &leak_[i])), set(1e-9));
  V leaked0 = hn::Mul(leak, set(row.start)), leaked1 = hn::Mul(leak, set(row.start + row.length));
  leaked0 = hn::Add(leaked0, set(row.coupled.value));
  leaked1 = hn::Add(leaked1, set(row.coupled.value + row.coupled.slope * row.length));
  if (!light_leak_.empty()) {
    const V light_leak = hn::Mul(hn::PromoteTo(d, hn::LoadU(df, &light_leak_[i])), set(0.5e-9 / kPerLight));
    const V rounded = hn::Round(hn::Mul(hn::Sub(hn::Sub(hn::Add(e0, e1), dark), dark), set(kPerLight)));
    const V sum0 = hn::LoadU(d, &light_sum_[i]), sum1 = hn::MulAdd(rounded, length, sum0);
    leaked0 = hn::MulAdd(light_leak, sum0, leaked0);
    leaked1 = hn::MulAdd(light_leak, sum1, leaked1);
    light_sum = sum1;
  }
  const V node_light = hn::PromoteTo(d, hn::LoadU(df, &node_light_[i]));
  const V guard = set(kGuard);
  auto uncertain = hn::Or(several, hn::Le(hn::LoadU(d, &until_[i]), set(row.start + row.length)));
  uncertain =
      hn::Or(uncertain, hn::Le(hn::Sub(hn::Add(lowest, hn::Min(leaked0, leaked1)), guard), hn::LoadU(d, &low_[i])));
  uncertain =
      hn::Or(uncertain, hn::Ge(hn::Add(hn::Add(highest, hn::Max(leaked0, leaked1)), guard), hn::LoadU(d, &high_[i])));
  uncertain = hn::Or(uncertain, hn::Ge(hn::Abs(hn::Sub(state.light, node_light)), set(kLightReach)));
  // Uncertain pixels keep their state before the segment for now. Nothing may be written behind the last pixel, where
  // other threads work.
  const bool whole = x + hn::Lanes(d) <= row.count;
  const auto inside = hn::FirstN(d, row.count - x), certain = hn::AndNot(uncertain, inside);
  const auto keep = [&](V value, LargeVector<double>& values) {
    if (whole) return hn::BlendedStore(value, certain, d, &values[i]);
    std::array<double, kVectorPadding> last{};
    hn::StoreU(hn::IfThenElse(certain, value, hn::LoadU(d, &values[i])), d, last.data());
    std::copy_n(last.data(), row.count - x, &values[i]);
  };
  keep(state.light, light_), keep(state.lag, lag_), keep(state.y, y_), keep(state.v, v_);
  if (!w_.empty()) keep(state.w, w_);
  if (!light_leak_.empty()) keep(light_sum, light_sum_);
  uncertain = hn::And(uncertain, inside);
  if (hn::AllFalse(d, uncertain)) return;
  const auto store = [&](V value, CircuitBuffer::Values<double>& values) { hn::StoreU(value, d, &values[at]); };
  store(state.light, buffer.light), store(state.lag, buffer.lag), store(state.y, buffer.y), store(state.v, buffer.v);
  store(state.w, buffer.w), store(light_sum, buffer.light_sum);
  store(piece.level, buffer.level), store(piece.rate, buffer.rate), store(piece.fast, buffer.fast);
  store(piece.slow, buffer.slow), store(piece.k1, buffer.k1), store(piece.passed, buffer.passed);
  const auto bits_of = [d](auto mask) {
    std::array<std::uint8_t, 8> bits{};
    hn::StoreMaskBits(d, mask, bits.data());
    return std::uint32_t{bits[0]};
  };
  // Bounds without an end belong to inactive pixels.
  const std::uint32_t many = bits_of(several), active = bits_of(hn::Lt(hn::LoadU(d, &until_[i]), hn::Inf(d)));
  for (std::uint32_t left = bits_of(uncertain); left != 0; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    auto& columns = (many >> k & 1U) != 0     ? buffer.uncertain.several
                    : (active >> k & 1U) != 0 ? buffer.uncertain.active
                                              : buffer.uncertain.inactive;
    columns.push_back(static_cast<std::uint32_t>(x + k));
    hwy::Prefetch(&states_[i + k]);
    hwy::Prefetch(&parameters_[i + k]);
  }
}

CircuitPixel CircuitArray::pixel(std::size_t i, KnownPath& known) {
  CircuitPixel pixel(circuit_, static_cast<std::uint32_t>(i), parameters_[i], states_[i], known);
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

/// Takes the front end of a pixel to the end of the segment.
void CircuitArray::keep(std::size_t i, std::size_t at, const CircuitBuffer& buffer) {
  light_[i] = buffer.light[at], lag_[i] = buffer.lag[at], y_[i] = buffer.y[at], v_[i] = buffer.v[at];
  if (!w_.empty()) w_[i] = buffer.w[at];
  if (!light_leak_.empty()) light_sum_[i] = buffer.light_sum[at];
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
                coupled_from(segment.t0),
                EventPacking(width_, height_)};
  std::array<double, 6> present{};
  std::size_t used = 0;
  for (auto* const values : front()) {
    if (values->empty()) continue;
    present[used] = (*values)[pixel];
    (*values)[pixel] = past.front[used++](column, line);
  }
  buffer.uncertain.clear();
  move_vector(hn::ScalableTag<double>(), row, 0, buffer, 0);
  advance_uncertain(row, 0, buffer);
  for (const auto& [unused, polarity, time] : buffer.found)
    requests.push_back({row.t0 + static_cast<TimeNs>(time), static_cast<std::uint16_t>(x),
                        static_cast<std::uint16_t>(y), static_cast<std::int8_t>(polarity)});
  buffer.found.clear();
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
                  coupled_from(segment.t0),
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
      advance_uncertain(row, begin, buffer);
      for (const auto& [column, polarity, time] : buffer.found) {
        if (buffer.events == kBlock) flush(row, buffer, events);
        const std::size_t n = buffer.events++;
        buffer.time[n] = time, buffer.polarity[n] = polarity, buffer.reported[n] = 1;
        buffer.place[n] = static_cast<std::uint32_t>(row.packing.place(row.x + static_cast<int>(column), row.y));
      }
      buffer.found.clear();
    }
    flush(row, buffer, events);
  }
  return true;
}

}  // namespace esim::inline event_camera

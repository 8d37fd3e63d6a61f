#include "esim/event_camera/circuit/circuit_lanes.h"

#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

constexpr std::size_t kDoublesPerStep = sizeof(PhotoreceptorNoise::Step) / sizeof(double);
static_assert(kDoublesPerStep == 5);

template <class D>
CircuitLanes::Lanes bits_of(D d, hn::Mask<D> mask) {
  std::array<std::uint8_t, 8> bits{};
  hn::StoreMaskBits(d, mask, bits.data());
  return bits[0];
}

template <class D>
hn::Mask<D> mask_of(D d, CircuitLanes::Lanes lanes) {
  const std::array<std::uint8_t, 8> bits{static_cast<std::uint8_t>(lanes)};
  return hn::LoadMaskBits(d, bits.data());
}

}  // namespace

std::size_t CircuitLanes::count() { return hn::Lanes(hn::CappedTag<double, kLanes>()); }

void CircuitLanes::enter(std::size_t lane, const Circuit& circuit, std::uint32_t pixel,
                         const CircuitParameters& parameters, const CircuitPixelState& state) {
  parameters_[lane] = &parameters, references_[lane] = state.reference;
  gain_[lane] = static_cast<double>(parameters.noise);
  upper_[lane] = state.reference + static_cast<double>(parameters.on);
  lower_[lane] = state.reference - static_cast<double>(parameters.off);
  from_y_[lane] = state.from.y, from_x_[lane] = state.from.x;
  to_y_[lane] = state.to.y, to_x_[lane] = state.to.x;
  node_time_[lane] = state.node_time;
  use_pole(*circuit.noise, lane, state.pole, state.node_light);
  pixels_[lane] = pixel, nodes_[lane] = state.node;
  crossings_[lane].reset(), known_[lane].node = KnownPath::kNone;
  drawn_[lane] = state.node - static_cast<std::uint32_t>(PhotoreceptorNoise::kNodesDrawn);  // none
}

void CircuitLanes::use_pole(const PhotoreceptorNoise& noise, std::size_t lane, std::int16_t pole, float node_light) {
  poles_[lane] = pole, node_light_[lane] = static_cast<double>(node_light);
  inactive_[lane] = kInactiveDeviations * gain_[lane] * noise.deviation(pole);
  step_[lane] = noise.step_ns(pole), decay_[lane] = noise.decay(pole);
  along_[lane] = noise.along(pole), margin_[lane] = noise.margin(pole);
  steps_[lane] = static_cast<std::int64_t>(kDoublesPerStep) * (noise.steps(pole) - noise.steps(0));
}

void CircuitLanes::leave(std::size_t lane, CircuitPixelState& state) const {
  state.pole = poles_[lane], state.node_light = static_cast<float>(node_light_[lane]);
  state.from = {from_y_[lane], from_x_[lane]}, state.to = {to_y_[lane], to_x_[lane]};
  state.node_time = node_time_[lane], state.node = nodes_[lane];
}

/// The draws of the next node of some lanes.
void CircuitLanes::draw(const Circuit& circuit, Lanes lanes, Values& n1, Values& n2) {
  const std::size_t lane_count = count();
  bool draws = false;
  for (std::size_t i = 0; i < lane_count; ++i) {
    nodes_[i] += lanes >> i & 1U;
    draws |= nodes_[i] - drawn_[i] >= PhotoreceptorNoise::kNodesDrawn;
  }
  if (draws) {
    for (std::size_t i = 0; i < lane_count; ++i) drawn_[i] = nodes_[i] & ~1U;
    circuit.noise->draw(lane_count, pixels_.data(), drawn_.data(), draws_);
  }
  for (std::size_t i = 0; i < lane_count; ++i) {
    const auto& n = draws_[nodes_[i] - drawn_[i]];
    n1[i] = static_cast<double>(n[0][i]), n2[i] = static_cast<double>(n[1][i]);
  }
}

/// As the first lines of CircuitPixel::find_near().
template <class D>
CircuitLanes::Lanes CircuitLanes::find_resting(D d, const Circuit& circuit, Lanes lanes) {
  using V = hn::Vec<D>;
  const auto set = [d](double value) { return hn::Set(d, value); };
  const auto load = [d](const Values& values) { return hn::Load(d, values.data()); };
  const V v_length = load(length), v_light = load(light), light_change = hn::Mul(load(light_rate), v_length);
  const V v_gain = load(gain_), one = set(1), t2_over_t1 = set(circuit.poles.t2_ns / circuit.poles.t1_unit_ns);
  const auto reach = [&](V at) {
    const V share = hn::Div(set(circuit.noise->variance()), hn::MulAdd(t2_over_t1, hn::Exp(d, at), one));
    return hn::Mul(hn::Mul(set(kActiveDeviations), v_gain), hn::Sqrt(share));
  };
  const double k_2 = 1 / circuit.poles.t2_ns, k_3 = circuit.poles.high_pass_per_ns;
  const V v_fast = load(fast), v_slow = load(slow), v_passed = load(passed), v_k1 = load(k1), from = load(s);
  const auto decayed = [&](V value, V per_ns, V at) {
    return hn::Mul(value, hn::Exp(d, hn::Neg(hn::Mul(per_ns, at))));
  };
  const V fast0 = decayed(v_fast, v_k1, from), fast1 = decayed(v_fast, v_k1, v_length);
  const V slow0 = decayed(v_slow, set(k_2), from), slow1 = decayed(v_slow, set(k_2), v_length);
  const V passed0 = decayed(v_passed, set(k_3), from), passed1 = decayed(v_passed, set(k_3), v_length);
  const auto signal = [&](V at, V a, V b, V c) {
    const V line = hn::MulAdd(hn::Add(load(rate), load(leak_rate)), at, hn::Add(load(level), load(leaked)));
    return hn::Add(hn::Add(line, a), hn::Add(b, c));
  };
  const V value0 = signal(from, fast0, slow0, passed0), value1 = signal(v_length, fast1, slow1, passed1);
  const V size1 = hn::Abs(fast0), size2 = hn::Abs(slow0), size3 = hn::Abs(passed0), span = hn::Sub(v_length, from);
  const V curvature =
      hn::MulAdd(hn::Mul(size1, v_k1), v_k1, hn::MulAdd(size2, set(k_2 * k_2), hn::Mul(size3, set(k_3 * k_3))));
  const V beyond =
      hn::Min(hn::Mul(hn::Mul(curvature, set(0.125)), hn::Mul(span, span)), hn::Add(hn::Add(size1, size2), size3));
  const V farthest = hn::Add(beyond, reach(hn::Min(v_light, hn::Add(v_light, light_change))));
  const auto rests = hn::And(hn::Lt(hn::Add(hn::Max(value0, value1), farthest), load(upper_)),
                             hn::Gt(hn::Sub(hn::Min(value0, value1), farthest), load(lower_)));
  hn::Store(reach(hn::Sub(hn::Add(v_light, light_change), set(kLightReach))), d, high_.data());
  return bits_of(d, rests) & lanes;
}

/// The event of a lane between two times, within its step.
std::optional<CircuitCrossing> CircuitLanes::find_crossing(const Circuit& circuit, std::size_t lane,
                                                           const SignalAt& from, const SignalAt& to) {
  CircuitPixelState state;
  leave(lane, state);
  state.reference = references_[lane];
  CircuitPixel pixel(circuit, pixels_[lane], *parameters_[lane], state, known_[lane]);
  pixel.set(piece(circuit, lane), {light[lane], light_rate[lane]}, {leaked[lane], leak_rate[lane]}, start[lane]);
  return pixel.find_crossing(from, to);
}

template <class D>
CircuitLanes::Lanes CircuitLanes::take_quiet_steps(D d, const Circuit& circuit, Lanes lanes) {
  using V = hn::Vec<D>;
  const auto set = [d](double value) { return hn::Set(d, value); };
  const auto load = [d](const Values& values) { return hn::Load(d, values.data()); };
  const double k_2 = 1 / circuit.poles.t2_ns, k_3 = circuit.poles.high_pass_per_ns;
  const V v_gain = load(gain_), v_upper = load(upper_), v_lower = load(lower_);
  const V v_level = hn::Add(load(level), load(leaked)), v_rate = hn::Add(load(rate), load(leak_rate));
  const V v_fast = load(fast), v_slow = load(slow), v_passed = load(passed), v_k1 = load(k1), v_length = load(length);
  const V curve1 = hn::Mul(hn::Mul(v_k1, v_k1), set(0.125)), curve2 = set(0.125 * k_2 * k_2),
          curve3 = set(0.125 * k_3 * k_3);
  const V v_start = load(start), v_light = load(light), v_light_rate = load(light_rate);
  const hn::RebindToSigned<D> di;
  const double* const steps = &circuit.noise->steps(0)->yy;
  V v_step = load(step_), v_node_light = load(node_light_), v_decay = load(decay_), v_inactive = load(inactive_);
  V v_along = load(along_), v_margin = load(margin_);
  auto v_steps = hn::Load(di, steps_.data());

  V from_y = load(from_y_), from_x = load(from_x_), to_y = load(to_y_), to_x = load(to_x_);
  V node_time = load(node_time_), here = load(s), v_low = hn::Zero(d), v_high = v_low;
  V fast_here = hn::Mul(v_fast, hn::Exp(d, hn::Neg(hn::Mul(v_k1, here))));
  V slow_here = hn::Mul(v_slow, hn::Exp(d, hn::Mul(set(-k_2), here)));
  V passed_here = k_3 > 0 ? hn::Mul(v_passed, hn::Exp(d, hn::Mul(set(-k_3), here))) : v_passed;
  V value = hn::Add(hn::Add(hn::MulAdd(v_rate, here, v_level), fast_here), hn::Add(slow_here, passed_here));
  const auto store = [d](V v, Values& values) { hn::Store(v, d, values.data()); };
  Lanes running = lanes, arrived = 0;
  alignas(64) Values n1{}, n2{};
  while (true) {
    // The signal and the noise on this step, as in CircuitPixel::run()
    const V node = hn::Sub(hn::Add(node_time, v_step), v_start), end = hn::Min(node, v_length);
    const V fast_end = hn::Mul(v_fast, hn::Exp(d, hn::Neg(hn::Mul(v_k1, end))));
    const V slow_end = hn::Mul(v_slow, hn::Exp(d, hn::Mul(set(-k_2), end)));
    const V passed_end = k_3 > 0 ? hn::Mul(v_passed, hn::Exp(d, hn::Mul(set(-k_3), end))) : passed_here;
    const V next = hn::Add(hn::Add(hn::MulAdd(v_rate, end, v_level), fast_end), hn::Add(slow_end, passed_end));
    const V span = hn::Sub(end, here);
    const V a = hn::MulAdd(hn::Sub(from_y, from_x), v_along, from_x);
    const V b = hn::NegMulAdd(hn::Sub(to_y, to_x), v_along, to_x);
    const V low_here = hn::Sub(hn::Min(hn::Min(from_x, to_x), hn::Min(a, b)), v_margin),
            high_here = hn::Add(hn::Max(hn::Max(from_x, to_x), hn::Max(a, b)), v_margin);
    const V size1 = hn::Abs(fast_here), size2 = hn::Abs(slow_here), size3 = hn::Abs(passed_here);
    const V curvature = hn::MulAdd(size1, curve1, hn::MulAdd(size2, curve2, hn::Mul(size3, curve3)));
    const V beyond = hn::Min(hn::Mul(curvature, hn::Mul(span, span)), hn::Add(hn::Add(size1, size2), size3));
    auto quiet = hn::And(hn::Gt(hn::MulAdd(v_gain, low_here, hn::Sub(hn::Min(value, next), beyond)), v_lower),
                         hn::Lt(hn::MulAdd(v_gain, high_here, hn::Add(hn::Max(value, next), beyond)), v_upper));
    if (const Lanes doubtful = running & ~bits_of(d, quiet); doubtful != 0) {
      store(here, s), store(node_time, node_time_);
      store(from_y, from_y_), store(from_x, from_x_), store(to_y, to_y_), store(to_x, to_x_);
      struct Ends {
        Values time, value, slope, fast, slow, passed;
        SignalAt at(std::size_t lane) const {
          return {time[lane], value[lane], slope[lane], fast[lane], slow[lane], passed[lane], 1};
        }
      };
      const auto ends = [&](V times, V values, V fasts, V slows, V passeds) {
        alignas(64) Ends e;
        const V slope =
            hn::NegMulAdd(passeds, set(k_3), hn::NegMulAdd(slows, set(k_2), hn::NegMulAdd(fasts, v_k1, v_rate)));
        store(times, e.time), store(values, e.value), store(slope, e.slope);
        store(fasts, e.fast), store(slows, e.slow), store(passeds, e.passed);
        return e;
      };
      const Ends from = ends(here, value, fast_here, slow_here, passed_here),
                 to = ends(end, next, fast_end, slow_end, passed_end);
      Lanes bits = bits_of(d, quiet);
      for (std::size_t lane = 0; lane < count(); ++lane) {
        if ((doubtful >> lane & 1U) == 0) continue;
        crossings_[lane] = find_crossing(circuit, lane, from.at(lane), to.at(lane));
        if (!crossings_[lane]) bits |= 1U << lane;
      }
      quiet = mask_of(d, bits);
    }
    const auto last = hn::Gt(node, v_length);
    const Lanes arrives = bits_of(d, hn::And(quiet, last)) & running;
    if (arrives != 0) {
      v_low = hn::IfThenElse(last, low_here, v_low), v_high = hn::IfThenElse(last, high_here, v_high);
      arrived |= arrives;
    }

    // The next step, as in CircuitPixel::pass_node()
    const V light_end = hn::MulAdd(v_light_rate, end, v_light);
    running &= bits_of(d, hn::AndNot(last, quiet));
    const V next_node = hn::Add(node_time, v_step);
    const Lanes far = bits_of(d, hn::Gt(hn::Abs(hn::Sub(v_node_light, light_end)), set(kLightReach))) & running;
    if (far != 0) {
      alignas(64) Values lights;
      hn::Store(light_end, d, lights.data());
      for (std::size_t lane = 0; lane < count(); ++lane) {
        if ((far >> lane & 1U) == 0) continue;
        const auto to_light = static_cast<float>(lights[lane]);
        use_pole(*circuit.noise, lane, circuit.pole(lights[lane]), to_light);
      }
      v_step = load(step_), v_node_light = load(node_light_), v_decay = load(decay_), v_inactive = load(inactive_);
      v_along = load(along_), v_margin = load(margin_);
      v_steps = hn::Load(di, steps_.data());
    }
    const V distance = hn::Min(hn::Sub(v_upper, next), hn::Sub(next, v_lower));
    running &= bits_of(d, hn::Lt(distance, v_inactive));
    if (running == 0) break;
    draw(circuit, running, n1, n2);
    const V place = hn::MulAdd(hn::Sub(v_node_light, light_end), set(1 / PhotoreceptorNoise::kDriftStep),
                               set(PhotoreceptorNoise::kDrifts));
    const V below = hn::Min(hn::Max(hn::Floor(place), hn::Zero(d)), set(2.0 * PhotoreceptorNoise::kDrifts - 1));
    const V part = hn::Sub(place, below);
    auto index = hn::ConvertTo(di, below);
    index = hn::Add(hn::Add(hn::ShiftLeft<2>(index), index), v_steps);  // kDoublesPerStep
    const auto at = [&](std::size_t offset) {
      const V v0 = hn::GatherIndex(d, steps + offset, index);
      const V v1 = hn::GatherIndex(d, steps + kDoublesPerStep + offset, index);
      return hn::MulAdd(part, hn::Sub(v1, v0), v0);
    };
    const V v_n1 = hn::Load(d, n1.data()), v_n2 = hn::Load(d, n2.data());
    const V y = hn::MulAdd(at(0), to_y, hn::Mul(at(2), v_n1));
    const V x = hn::MulAdd(at(1), to_y, hn::MulAdd(v_decay, to_x, hn::MulAdd(at(3), v_n1, hn::Mul(at(4), v_n2))));
    const auto goes = mask_of(d, running);
    const auto move = [&](V& to, V moved) { to = hn::IfThenElse(goes, moved, to); };
    move(from_y, to_y), move(from_x, to_x), move(to_y, y), move(to_x, x);
    move(node_time, next_node), move(here, end), move(value, next);
    move(fast_here, fast_end), move(slow_here, slow_end), move(passed_here, passed_end);
  }
  store(from_y, from_y_), store(from_x, from_x_), store(to_y, to_y_), store(to_x, to_x_);
  store(node_time, node_time_), store(here, s), store(v_low, low_), store(v_high, high_);
  return arrived;
}

CircuitLanes::Lanes CircuitLanes::find_resting(const Circuit& circuit, Lanes lanes) {
  return find_resting(hn::CappedTag<double, kLanes>(), circuit, lanes);
}

CircuitLanes::Lanes CircuitLanes::take_quiet_steps(const Circuit& circuit, Lanes lanes) {
  return take_quiet_steps(hn::CappedTag<double, kLanes>(), circuit, lanes);
}

}  // namespace esim::inline event_camera

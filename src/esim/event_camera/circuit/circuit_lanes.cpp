#include "esim/event_camera/circuit/circuit_lanes.h"

#include "esim/core/vector_math.h"
#include "esim/event_camera/circuit/photoreceptor_vectors.h"

namespace esim::inline event_camera {
namespace {

// Lanes of floats, and of their doubles in two vectors.
using F = NoiseLanes;
using D = hn::CappedTag<double, CircuitLanes::kLanes / 2>;
using VF = hn::Vec<F>;
using VD = hn::Vec<D>;
static_assert(hn::MaxLanes(F()) == 2 * hn::MaxLanes(D()));

template <class Tag>
CircuitLanes::Lanes bits_of(Tag d, hn::Mask<Tag> mask) {
  std::array<std::uint8_t, 8> bits{};
  hn::StoreMaskBits(d, mask, bits.data());
  return bits[0];
}

template <class Tag>
hn::Mask<Tag> mask_of(Tag d, CircuitLanes::Lanes lanes) {
  const std::array<std::uint8_t, 8> bits{static_cast<std::uint8_t>(lanes)};
  return hn::LoadMaskBits(d, bits.data());
}

VF load(const CircuitLanes::Floats& values) { return hn::Load(F(), values.data()); }
void store(VF values, CircuitLanes::Floats& to) { hn::Store(values, F(), to.data()); }

/// The values of doubles(i) for both halves of the lanes, i the first lane.
template <class Doubles>
HWY_INLINE VF floats_of(const Doubles& doubles) {
  const hn::Rebind<float, D> half;
  return hn::Combine(F(), hn::DemoteTo(half, doubles(hn::Lanes(D()))), hn::DemoteTo(half, doubles(0)));
}
VF floats_of(const CircuitLanes::Values& values) {
  return floats_of([&](std::size_t i) { return hn::Load(D(), &values[i]); });
}

}  // namespace

/// The signals minus the references.
struct CircuitLanes::Signals : FloatSignals<F> {
  Signals(const CircuitLanes& lanes, const CircuitPoles& poles) {
    level = floats_of([&](std::size_t i) {
      const VD sum = hn::Add(hn::Load(D(), &lanes.level[i]), hn::Load(D(), &lanes.leaked[i]));
      return hn::Sub(sum, hn::Load(D(), &lanes.reference_[i]));
    });
    rate = floats_of(
        [&](std::size_t i) { return hn::Add(hn::Load(D(), &lanes.rate[i]), hn::Load(D(), &lanes.leak_rate[i])); });
    fast = floats_of(lanes.fast), slow = floats_of(lanes.slow), passed = floats_of(lanes.passed);
    k1 = floats_of(lanes.k1);
    k2 = hn::Set(F(), static_cast<float>(1 / poles.t2_ns));
    k3 = hn::Set(F(), static_cast<float>(poles.high_pass_per_ns));
    has_high_pass = poles.high_pass_per_ns > 0;
    set_guard(F(), floats_of(lanes.length));
  }
};

std::size_t CircuitLanes::count() { return hn::Lanes(F()); }

void CircuitLanes::enter(std::size_t lane, const Circuit& circuit, std::uint32_t pixel,
                         const CircuitParameters& parameters, const CircuitPixelState& state) {
  parameters_[lane] = &parameters, reference_[lane] = state.reference;
  gain_[lane] = parameters.noise, on_[lane] = parameters.on, off_[lane] = parameters.off;
  from_y_[lane] = state.from.y, from_x_[lane] = state.from.x;
  to_y_[lane] = state.to.y, to_x_[lane] = state.to.x;
  node_time_[lane] = state.node_time;
  use_pole(*circuit.noise, lane, state.pole, state.node_light);
  pixels_[lane] = pixel, nodes_[lane] = state.node;
  crossings_[lane].reset(), known_[lane].node = KnownPath::kNone;
  is_active_ |= 1U << lane;
  drawn_[lane] = state.node - static_cast<std::uint32_t>(PhotoreceptorNoise::kNodesDrawn);  // none
}

void CircuitLanes::use_pole(const PhotoreceptorNoise& noise, std::size_t lane, std::int16_t pole, float node_light) {
  poles_[lane] = pole, node_light_[lane] = node_light;
  inactive_[lane] = static_cast<float>(kInactiveDeviations * noise.deviation(pole)) * gain_[lane];
  step_[lane] = noise.step_ns(pole);
  along_[lane] = noise.along(pole), margin_[lane] = noise.margin(pole);
  has_step_ &= ~(1U << lane);
}

void CircuitLanes::load_step(const PhotoreceptorNoise& noise, std::size_t lane) {
  const PhotoreceptorNoise::Step& step = noise.step(poles_[lane]);
  for (std::size_t i = 0; i < step.kFactors; ++i) {
    for (std::size_t k = 0; k < 3; ++k) parabolas_[i][k][lane] = step.parabolas[i][k];
  }
  xx_[lane] = step.xx;
  has_step_ |= 1U << lane;
}

void CircuitLanes::leave(std::size_t lane, CircuitPixelState& state) const {
  state.pole = poles_[lane], state.node_light = node_light_[lane];
  state.from = {from_y_[lane], from_x_[lane]}, state.to = {to_y_[lane], to_x_[lane]};
  state.node_time = node_time_[lane], state.node = nodes_[lane];
  state.active = (is_active_ >> lane & 1U) != 0;
}

/// The draws of the next node of some lanes.
void CircuitLanes::draw(const Circuit& circuit, Lanes lanes) {
  const std::size_t lane_count = count();
  bool draws = false;
  for (std::size_t i = 0; i < lane_count; ++i) {
    nodes_[i] += lanes >> i & 1U;
    draws |= (lanes >> i & 1U) != 0 && nodes_[i] - drawn_[i] >= PhotoreceptorNoise::kNodesDrawn;
  }
  if (draws) {
    for (std::size_t i = 0; i < lane_count; ++i) drawn_[i] = nodes_[i] & ~1U;
    circuit.noise->draw(lane_count, pixels_.data(), drawn_.data(), draws_);
  }
  for (std::size_t i = 0; i < lane_count; ++i) {
    const auto& n = draws_[nodes_[i] & 1U];
    n1_[i] = n[0][i], n2_[i] = n[1][i];
  }
}

/// As the first lines of CircuitPixel::find_near().
CircuitLanes::Lanes CircuitLanes::find_resting(const Circuit& circuit, Lanes lanes) {
  const F d;
  const Signals signals(*this, circuit.poles);
  const auto first = signals.at(d, hn::Zero(d)), last = signals.at(d, floats_of(length));
  const VF light0 = floats_of(light), change = hn::Mul(floats_of(light_rate), last.time);
  const VF one = hn::Set(d, 1.0F);
  const VF t2_per_t1 = hn::Set(d, static_cast<float>(circuit.poles.t2_ns / circuit.poles.t1_unit_ns));
  const VF variance = hn::Set(d, static_cast<float>(circuit.noise->variance()));
  const auto reach = [&](VF at) {
    const VF part = hn::Div(variance, hn::MulAdd(t2_per_t1, hn::Exp(d, at), one));
    return hn::Mul(hn::Mul(hn::Set(d, static_cast<float>(kActiveDeviations)), load(gain_)), hn::Sqrt(part));
  };
  const VF darkest = hn::Min(light0, hn::Add(light0, change));
  const VF farthest = reach(darkest);
  const auto [lowest, highest] = signals.range(d, first, last);
  const auto rests =
      hn::And(hn::Lt(hn::Add(highest, farthest), load(on_)), hn::Lt(hn::Sub(farthest, lowest), load(off_)));
  store(reach(hn::Sub(hn::Add(light0, change), hn::Set(d, static_cast<float>(kLightReach)))), high_);
  return bits_of(d, rests) & lanes;
}

/// The event of a lane between `s` and `end`, within its step.
std::optional<CircuitCrossing> CircuitLanes::find_crossing(const Circuit& circuit, std::size_t lane, double end) {
  CircuitPixelState state;
  leave(lane, state);
  state.reference = reference_[lane];
  CircuitPixel pixel(circuit, pixels_[lane], *parameters_[lane], state, known_[lane]);
  pixel.set(piece(circuit, lane), {light[lane], light_rate[lane]}, {leaked[lane], leak_rate[lane]}, start[lane]);
  return pixel.find_crossing(s[lane], end);
}

CircuitLanes::Lanes CircuitLanes::take_quiet_steps(const Circuit& circuit, Lanes lanes) {
  const F d;
  const D dd;
  const Signals signals(*this, circuit.poles);
  const VF gain = load(gain_), on = load(on_), off = load(off_);
  const VF light0 = floats_of(light), light_change = floats_of(light_rate);
  VF from_y = load(from_y_), from_x = load(from_x_), to_y = load(to_y_), to_x = load(to_x_);
  VF low = hn::Zero(d), high = low;
  auto here = signals.at(d, floats_of(s));
  Lanes running = lanes, arrived = 0;
  alignas(64) Values next_nodes{}, ends{};
  const auto save = [&] { store(from_y, from_y_), store(from_x, from_x_), store(to_y, to_y_), store(to_x, to_x_); };
  while (true) {
    // The signal and the noise on this step, as in CircuitPixel::run()
    Lanes last = 0;
    for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(dd)) {
      const VD node_time = hn::Add(hn::Load(dd, &node_time_[i]), hn::Load(dd, &step_[i]));
      const VD node = hn::Sub(node_time, hn::Load(dd, &start[i])), piece_end = hn::Load(dd, &length[i]);
      last |= bits_of(dd, hn::Gt(node, piece_end)) << i;
      hn::Store(node_time, dd, &next_nodes[i]);
      hn::Store(hn::Min(node, piece_end), dd, &ends[i]);
    }
    const auto next = signals.at(d, floats_of(ends));
    const auto [low_at, high_at] = cubic_bounds(from_y, from_x, to_y, to_x, load(along_));
    const VF low_here = hn::Sub(low_at, load(margin_)), high_here = hn::Add(high_at, load(margin_));
    const auto [lowest, highest] = signals.range(d, here, next);
    Lanes quiet = bits_of(d, hn::And(hn::Lt(hn::MulAdd(gain, high_here, highest), on),
                                     hn::Gt(hn::Add(hn::MulAdd(gain, low_here, lowest), off), hn::Zero(d))));
    if (const Lanes doubtful = running & ~quiet; doubtful != 0) {
      save();
      for (std::size_t lane = 0; lane < count(); ++lane) {
        if ((doubtful >> lane & 1U) == 0) continue;
        crossings_[lane] = find_crossing(circuit, lane, ends[lane]);
        if (!crossings_[lane]) quiet |= 1U << lane;
      }
    }
    if (const Lanes arrives = running & quiet & last; arrives != 0) {
      const auto mask = mask_of(d, arrives);
      low = hn::IfThenElse(mask, low_here, low), high = hn::IfThenElse(mask, high_here, high);
      arrived |= arrives;
    }

    // The next step, as in CircuitPixel::pass_node()
    running &= quiet & ~last;
    if (running == 0) break;
    const VF light_end = hn::MulAdd(light_change, next.time, light0);
    const VF far = hn::Abs(hn::Sub(load(node_light_), light_end));
    const Lanes changes = bits_of(d, hn::Gt(far, hn::Set(d, static_cast<float>(kLightReach)))) & running;
    for (std::size_t lane = 0; lane < count() && changes != 0; ++lane) {
      if ((changes >> lane & 1U) == 0) continue;
      const double to_light = light[lane] + light_rate[lane] * ends[lane];
      use_pole(*circuit.noise, lane, circuit.pole(to_light), static_cast<float>(to_light));
    }
    const VF distance = hn::Min(hn::Sub(on, next.value), hn::Add(next.value, off));
    const Lanes matters = bits_of(d, hn::Lt(distance, load(inactive_)));
    for (std::size_t lane = 0; lane < count(); ++lane) {
      if ((running >> lane & 1U) == 0) continue;
      node_time_[lane] = next_nodes[lane], s[lane] = ends[lane];
      if ((matters >> lane & 1U) == 0) {
        ++nodes_[lane];
      } else if ((has_step_ >> lane & 1U) == 0) {
        load_step(*circuit.noise, lane);
      }
    }
    const auto passes = mask_of(d, running);
    const auto move = [&](auto& to, auto moved) { to = hn::IfThenElse(passes, moved, to); };
    move(from_y, to_y), move(from_x, to_x);
    move(here.time, next.time), move(here.value, next.value);
    move(here.fast, next.fast), move(here.slow, next.slow), move(here.passed, next.passed);
    is_active_ &= ~running | matters;
    running &= matters;
    if (running == 0) break;
    draw(circuit, running);
    const auto parabola = [&](std::size_t factor, std::size_t i) { return load(parabolas_[factor][i]); };
    VF y = to_y, x = to_x;
    noise_step(d, parabola, load(xx_), hn::Sub(load(node_light_), light_end), load(n1_), load(n2_), y, x);
    const auto steps = mask_of(d, running);
    to_y = hn::IfThenElse(steps, y, to_y), to_x = hn::IfThenElse(steps, x, to_x);
  }
  save();
  store(low, low_), store(high, high_);
  return arrived;
}

}  // namespace esim::inline event_camera

#include "esim/event_camera/circuit/circuit_pixel.h"

#include <bit>

#include "esim/core/vector_math.h"
#include "esim/event_camera/circuit/photoreceptor_vectors.h"

namespace esim::inline event_camera {
namespace {

constexpr double kRestingDeviations = 3.5;

}  // namespace

SignalAt CircuitPixel::at(double s) const {
  const hn::CappedTag<double, 4> d;
  alignas(32) std::array<double, 4> terms = terms_;
  if (s != 0) {
    for (std::size_t i = 0; i < terms.size(); i += hn::Lanes(d)) {
      const auto decay = hn::Exp(d, hn::Mul(hn::Load(d, &decays_[i]), hn::Set(d, s)));
      hn::Store(hn::Mul(hn::Load(d, &terms_[i]), decay), d, &terms[i]);
    }
  }
  SignalAt at{s, 0, 0, terms[0], terms[1], terms[2]};
  at.value = piece_.level + piece_.rate * s + at.fast + at.slow + at.passed + leaked(s);
  at.slope = piece_.rate - at.fast * piece_.k1 - at.slow * piece_.k2 - at.passed * piece_.k3 + leak_.rate;
  return at;
}

CircuitPixel::Approach CircuitPixel::approach(const SignalAt& signal) const {
  const double above = upper() - signal.value, below = signal.value - lower();
  Approach here{signal, std::min(above, below), above < below ? -signal.slope : signal.slope, 0};
  if (noise_ == nullptr) return here;
  const auto deviation = noise_->deviation_at(circuit_.log_t1_unit - light(signal.s));
  here.reach = kActiveDeviations * gain_ * deviation.value;
  here.distance -= here.reach;
  here.slope += kActiveDeviations * gain_ * deviation.slope * light_.rate;
  return here;
}

/// The first time between a and b at which the signal is so near to a threshold that the noise matters; without noise,
/// at which it reaches the threshold.
std::optional<double> CircuitPixel::find_near(const Approach& a, const Approach& b) const {
  const double va = a.signal.value, vb = b.signal.value, length = b.signal.s - a.signal.s;
  // The reach of the noise falls with rising light, so that it is maximal at one of the ends.
  const double beyond = beyond_chord(a.signal, b.signal) + std::max(a.reach, b.reach);
  if (std::max(va, vb) + beyond < upper() && std::min(va, vb) - beyond > lower()) return std::nullopt;
  if (a.distance <= 0) return a.signal.s;
  if (length <= resolution_ns()) return b.distance <= 0 ? std::optional(b.signal.s) : std::nullopt;
  if (b.distance <= 0 && is_monotone(a.signal, b.signal)) return solve_near(a, b);
  const Approach middle = approach(at(0.5 * (a.signal.s + b.signal.s)));
  if (const auto found = find_near(a, middle)) return found;
  return find_near(middle, b);
}

/// The same if the signal is monotone, near a threshold at b and not at a.
double CircuitPixel::solve_near(const Approach& a, const Approach& b) const {
  double from = a.signal.s, to = b.signal.s;
  // A cubic with the same values and slopes at the ends leads near the root.
  const auto exit = NoiseCubic{a.distance, a.slope, b.distance, b.slope, to - from}.first_exit(0, kNever);
  double s = exit ? from + exit->first : 0.5 * (from + to);
  // Newton's method, with bisection where it would leave the part that contains the root. Its error after a step is
  // about the step's square divided by the length of the part.
  const double enough = std::sqrt(0.5 * resolution_ns() * (to - from));
  for (int i = 0; i < 60 && to - from > resolution_ns(); ++i) {
    const Approach here = approach(at(s));
    (here.distance <= 0 ? to : from) = s;
    const double next = s - here.distance / here.slope, before = s;
    s = next >= from && next <= to ? next : 0.5 * (from + to);
    if (std::abs(s - before) < enough && s == next) break;
  }
  return s;
}

/// Whether the signal plus noise may reach a threshold between a and b, within the step at the last node.
bool CircuitPixel::may_cross(const SignalAt& a, const SignalAt& b) const {
  const auto [low, high] = noise_->bounds(state_.from, state_.to, state_.pole);
  const double beyond = beyond_chord(a, b);
  return std::min(a.value, b.value) - beyond + gain_ * low <= lower() ||
         std::max(a.value, b.value) + beyond + gain_ * high >= upper();
}

/// The parts of the step in which the same may happen between a and b: one bit each.
std::uint32_t CircuitPixel::doubtful_parts(double a, double b) const {
  const NoiseLanes d;
  const auto set = [d](double value) { return hn::Set(d, static_cast<float>(value)); };
  FloatSignals<NoiseLanes> signal{set(piece_.level + leak_.leaked - state_.reference),
                                  set(piece_.rate + leak_.rate),
                                  set(piece_.fast),
                                  set(piece_.slow),
                                  set(piece_.passed),
                                  set(piece_.k1),
                                  set(piece_.k2),
                                  set(piece_.k3),
                                  hn::Zero(d),
                                  piece_.k3 > 0};
  signal.set_guard(d, set(piece_.length));
  const PhotoreceptorNoise::Path& path = this->path();
  const double part = noise_->part_ns(state_.pole);
  const auto start = set(state_.node_time - start_), length = set(part), first = set(a), last = set(b);
  const auto along = set(part / (3 * circuit_.poles.t2_ns)), gain = set(gain_);
  std::uint32_t doubtful = 0;
  for (std::size_t i = 0; i < PhotoreceptorNoise::kParts; i += hn::Lanes(d)) {
    const auto index = hn::Iota(d, static_cast<float>(i)), t0 = hn::MulAdd(index, length, start);
    const auto from = signal.at(d, hn::Max(first, hn::Min(t0, last)));
    const auto to = signal.at(d, hn::Max(first, hn::Min(hn::Add(t0, length), last)));
    const auto load = [&](const float* values) { return hn::LoadU(d, values + i); };
    const auto [low, high] =
        cubic_bounds(load(&path.y[0]), load(&path.x[0]), load(&path.y[1]), load(&path.x[1]), along);
    const auto [lowest, highest] = signal.range(d, from, to);
    const auto quiet = hn::And(hn::Lt(hn::MulAdd(gain, high, highest), hn::Set(d, parameters_.on)),
                               hn::Gt(hn::MulAdd(gain, low, lowest), hn::Set(d, -parameters_.off)));
    std::array<std::uint8_t, 8> bits{};
    hn::StoreMaskBits(d, hn::Not(quiet), bits.data());
    doubtful |= static_cast<std::uint32_t>(bits[0]) << i;
  }
  return doubtful;
}

std::optional<CircuitCrossing> CircuitPixel::find_crossing(double a, double b) const {
  const double start = state_.node_time - start_, length = noise_->part_ns(state_.pole);
  const PhotoreceptorNoise::Path& path = this->path();
  for (std::uint32_t parts = doubtful_parts(a, b); parts != 0; parts &= parts - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(parts));
    const double part_start = start + static_cast<double>(i) * length;
    const double begin = std::max(a, part_start);
    const double end = i + 1 == PhotoreceptorNoise::kParts ? b : std::min(b, part_start + length);
    if (begin >= end) continue;
    const NoiseCubic noise = noise_->cubic(path, i, state_.pole);
    const SignalAt from = at(begin), to = at(end);
    const double u = begin - part_start, v = end - part_start;
    const NoiseCubic sum{from.value + gain_ * noise.value(u), from.slope + gain_ * noise.slope(u),
                         to.value + gain_ * noise.value(v), to.slope + gain_ * noise.slope(v), end - begin};
    if (const auto exit = sum.first_exit(lower(), upper())) return CircuitCrossing{begin + exit->first, exit->second};
  }
  return std::nullopt;
}

const PhotoreceptorNoise::Path& CircuitPixel::path() const {
  if (known_.node != state_.node) {
    known_.path = noise_->path(state_.from, state_.to, pixel_, state_.node, state_.pole);
    known_.node = state_.node;
  }
  return known_.path;
}

/// Chooses the length of steps for the light at `s`.
void CircuitPixel::follow_light(double s) {
  state_.node_light = static_cast<float>(light(s));
  state_.pole = circuit_.pole(light(s));
}

/// The draws of the last node.
std::array<float, 2> CircuitPixel::draws() {
  if (state_.node - drawn_ >= 2 * PhotoreceptorNoise::kNodesDrawn) {
    drawn_ = state_.node & ~1U;
    const std::array<std::uint32_t, 2> pixels{pixel_, pixel_}, first{drawn_, drawn_ + 2};
    noise_->draw(2, pixels.data(), first.data(), draws_);
  }
  const std::uint32_t place = state_.node - drawn_;
  const auto& n = draws_[place & 1U];
  return {n[0][place >> 1], n[1][place >> 1]};
}

/// Begins a step at a node, whose number is the next one.
void CircuitPixel::start_step(const NoiseState& from, double time) {
  state_.node += 1;
  state_.node_time = time;
  state_.from = from;
  state_.active = true;
  const float drift = state_.node_light - static_cast<float>(light(time - start_));
  state_.to = noise_->after_step(from, draws(), state_.pole, drift);
}

/// At the end of a step, where the signal is `value`: begins the next one, if the noise still matters.
void CircuitPixel::pass_node(const SignalAt& here) {
  const double time = state_.node_time + noise_->step_ns(state_.pole);
  if (std::abs(light(here.s) - static_cast<double>(state_.node_light)) > kLightReach) follow_light(here.s);
  const double distance = std::min(upper() - here.value, here.value - lower());
  if (distance < kInactiveDeviations * gain_ * noise_->deviation(state_.pole)) {
    start_step(state_.to, time);
    return;
  }
  state_.from = state_.to;
  state_.node += 1;
  state_.node_time = time;
  state_.active = false;
}

/// Begins with steps, somewhere between the last node and the next one.
void CircuitPixel::activate(double s) {
  follow_light(s);
  state_.node += 1;
  start_step(noise_->after_gap(state_.from, draws(), start_ + s - state_.node_time, state_.pole), start_ + s);
}

/// The noise at `s`, at the end of a reset. It continues from the last node before, whatever the signal did meanwhile.
double CircuitPixel::noise_at(double s) {
  if (state_.active) {
    const double end = state_.node_time + noise_->step_ns(state_.pole);
    if (end > start_ + s) return noise_->at(path(), start_ + s - state_.node_time, state_.pole);
    state_.from = state_.to;
    state_.node_time = end;
    state_.node += 1;
    state_.active = false;
  }
  follow_light(s);
  state_.node += 1;
  state_.from = noise_->after_gap(state_.from, draws(), start_ + s - state_.node_time, state_.pole);
  state_.node_time = start_ + s;
  return static_cast<double>(state_.from.x);
}

void CircuitPixel::open(double light, double signal, const LeakRamp& leak, double time, double place) {
  state_ = {};
  // The noise fires a pixel before it comes nearer to a threshold than its reach.
  const double reach = noise_ == nullptr ? 0.0 : kRestingDeviations * gain_ * circuit_.deviation(light);
  const double above = std::max(0.0, static_cast<double>(parameters_.on) - reach),
               below = std::max(0.0, static_cast<double>(parameters_.off) - reach);
  const double beyond = place * (above + below) - below;
  state_.reference = signal + leak.leaked - beyond;
  state_.node_time = time;
  state_.node_light = static_cast<float>(light);
  if (origin_ != nullptr) {
    // If the pixel leaks, the leak has brought it to its place; otherwise noise, or what it saw before.
    *origin_ = {signal, leak.rate != 0 ? leak.leaked - beyond : leak.leaked};
  }
  if (noise_ == nullptr) return;
  state_.pole = circuit_.pole(light);
  state_.from = noise_->first(pixel_, state_.pole);
  state_.reference += gain_ * static_cast<double>(state_.from.x);
}

/// Ends the reset of a pixel: its new reference is signal plus noise.
void CircuitPixel::release(const SignalAt& here) {
  state_.held_until = -1;
  if (origin_ != nullptr) origin_->v = piece_.value(here.s), origin_->leaked = leaked(here.s);
  const double value = here.value + (noise_ != nullptr ? gain_ * noise_at(here.s) : 0.0);
  const double change = value - state_.reference;
  lost_ +=
      static_cast<std::int64_t>(std::abs(change) / static_cast<double>(change > 0 ? parameters_.on : parameters_.off));
  state_.reference = value;
}

/// (15) of docs/methods/pixel.md. Noise is the rest of the threshold; without noise, the signal is.
void CircuitPixel::take_apart(double s, int polarity) {
  CircuitOrigin& o = *origin_;
  const double threshold = polarity > 0 ? static_cast<double>(parameters_.on) : -static_cast<double>(parameters_.off);
  const double v = piece_.value(s), all = leaked(s), leak = all - o.leaked;
  const double signal = noise_ != nullptr ? v - o.v : threshold - leak;
  o = {v, all, static_cast<float>(signal), static_cast<float>(threshold - leak - signal), static_cast<float>(leak)};
}

CircuitBounds CircuitPixel::bounds_without_noise() {
  const double light_now = light(piece_.length);
  state_.node_light = static_cast<float>(light_now);
  const double margin =
      noise_ == nullptr ? 0.0 : kActiveDeviations * gain_ * circuit_.deviation(light_now - kLightReach);
  return {margin - static_cast<double>(parameters_.off), static_cast<double>(parameters_.on) - margin, kNever};
}

}  // namespace esim::inline event_camera

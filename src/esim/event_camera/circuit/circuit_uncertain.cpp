// What CircuitArray does with the pixels that are uncertain in a segment.
#include <algorithm>
#include <cmath>

#include "esim/core/vector_math.h"
#include "esim/event_camera/circuit/circuit_array.h"
#include "esim/event_camera/circuit/photoreceptor_vectors.h"

namespace esim::inline event_camera {

void CircuitArray::set_bounds(std::size_t pixel, const CircuitBounds& bounds) {
  const double reference = states_[pixel].reference;
  low_[pixel] = reference + bounds.low;
  high_[pixel] = reference + bounds.high;
  until_[pixel] = bounds.until;
  node_light_[pixel] = states_[pixel].node_light;
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

/// What leak and frames add to the input of the comparators of the pixel of a column during the segment.
LeakRamp CircuitArray::leak_in(const Row& row, std::size_t column, std::size_t at, const CircuitBuffer& buffer) const {
  const std::size_t i = row.first + column;
  LeakRamp all = leak(i, light_leak_.empty() ? 0.0 : (buffer.light_sum[at] - light_sum_[i]) / row.length, row.start);
  all.leaked += row.coupled.value;
  all.rate += row.coupled.slope;
  return all;
}

/// Takes the pixel of a column to the segment's end, from where its lane is in its piece, which begins `done` ns after
/// the segment's start. `front` is its front end after this piece.
void CircuitArray::finish(const Row& row, std::uint32_t column, std::size_t at, const CircuitPiece& piece, double done,
                          std::size_t lane, CircuitState& front, CircuitBuffer& buffer) {
  const std::size_t i = row.first + column;
  const auto emit_event = [&](double t, int polarity) {
    const double time = std::clamp(std::ceil(t - row.start), 0.0, row.length);
    buffer.found.push_back({column, polarity, time});
    if (!origins_.empty()) label(i, row.t0 + static_cast<TimeNs>(time), polarity, buffer.labels);
  };
  const LightRamp ramp{light_[i], (buffer.light[at] - light_[i]) / row.length};
  const LeakRamp leak = leak_in(row, column, at, buffer);
  CircuitPixel pixel = this->pixel(i, buffer.lanes.known(lane));
  const auto run = [&](const CircuitPiece& of, double begin, double from, std::optional<CircuitCrossing> crossing) {
    pixel.set(of, {ramp.light + ramp.rate * begin, ramp.rate}, {leak.leaked + leak.rate * begin, leak.rate},
              row.start + begin);
    set_bounds(i, pixel.run(emit_event, from, crossing));
    buffer.lost += limits_ ? pixel.lost() : 0;
  };
  run(piece, done, buffer.lanes.s[lane], buffer.lanes.crossing(lane));
  done = piece.length < row.length - done ? done + piece.length : row.length;
  while (done < row.length) {
    const LightRamp part{ramp.light + ramp.rate * done, ramp.rate};
    const double h = step_length(circuit_.poles, front, part, row.length - done);
    const CircuitPiece next = esim::advance(circuit_.poles, front, part, h);
    const auto [lowest, highest] = next.range(0, h);
    const double leaked0 = leak.leaked + leak.rate * done, leaked1 = leaked0 + leak.rate * h;
    const double change = part.light + part.rate * h - static_cast<double>(node_light_[i]);
    const bool quiet = lowest + std::min(leaked0, leaked1) - kGuard > low_[i] &&
                       highest + std::max(leaked0, leaked1) + kGuard < high_[i] && row.start + done + h < until_[i] &&
                       std::abs(change) < kLightReach;
    if (!quiet) run(next, done, 0, {});
    done = h < row.length - done ? done + h : row.length;
  }
}

/// Prepares inactive pixels, which are not held, for the pieces in their lanes. Returns those that become active, which
/// it has put into their lanes again; `rests` are the others.
CircuitLanes::Lanes CircuitArray::wake(CircuitLanes& lanes, const std::array<std::size_t, CircuitLanes::kLanes>& pixels,
                                       CircuitLanes::Lanes inactive, CircuitLanes::Lanes& rests) {
  rests = inactive != 0 ? lanes.find_resting(circuit_, inactive) : 0;
  CircuitLanes::Lanes active = 0;
  for (std::size_t lane = 0; lane < CircuitLanes::count(); ++lane) {
    if ((inactive >> lane & 1U) == 0) continue;
    const std::size_t i = pixels[lane];
    if ((rests >> lane & 1U) != 0) {
      set_bounds(i, lanes.resting_bounds(lane, parameters_[i], states_[i]));
      continue;
    }
    CircuitPixel pixel = this->pixel(i, lanes.known(lane));
    pixel.set(lanes.piece(circuit_, lane), {lanes.light[lane], lanes.light_rate[lane]},
              {lanes.leaked[lane], lanes.leak_rate[lane]}, lanes.start[lane]);
    if (const auto near = pixel.wake(pixel.at(0))) {
      lanes.enter(lane, circuit_, static_cast<std::uint32_t>(i), parameters_[i], states_[i]);
      lanes.s[lane] = *near;
      active |= 1U << lane;
    } else {
      set_bounds(i, pixel.bounds_without_noise());
      rests |= 1U << lane;
    }
  }
  return active;
}

/// Takes uncertain pixels to the segment's end that need one step only: side by side, until something happens in them.
void CircuitArray::advance_in_one(const Row& row, std::span<const std::uint32_t> columns, std::size_t begin,
                                  CircuitBuffer& buffer) {
  CircuitLanes& lanes = buffer.lanes;
  std::array<std::size_t, CircuitLanes::kLanes> pixels{};
  CircuitLanes::Lanes active = 0, inactive = 0, rests = 0;
  for (std::size_t lane = 0; lane < columns.size(); ++lane) {
    const std::uint32_t column = columns[lane];
    const std::size_t i = row.first + column, at = column - begin;
    pixels[lane] = i;
    if (circuit_.noise) lanes.enter(lane, circuit_, static_cast<std::uint32_t>(i), parameters_[i], states_[i]);
    lanes.level[lane] = buffer.level[at], lanes.rate[lane] = buffer.rate[at];
    lanes.fast[lane] = buffer.fast[at], lanes.slow[lane] = buffer.slow[at];
    lanes.k1[lane] = buffer.k1[at], lanes.passed[lane] = buffer.passed[at];
    lanes.length[lane] = row.length, lanes.start[lane] = row.start;
    lanes.light[lane] = light_[i], lanes.light_rate[lane] = (buffer.light[at] - light_[i]) / row.length;
    const LeakRamp leak = leak_in(row, column, at, buffer);
    lanes.leaked[lane] = leak.leaked, lanes.leak_rate[lane] = leak.rate;
    lanes.s[lane] = 0;
    if (circuit_.noise && states_[i].held_until <= row.start) (states_[i].active ? active : inactive) |= 1U << lane;
  }
  active |= wake(lanes, pixels, inactive, rests);
  const CircuitLanes::Lanes arrived = active != 0 ? lanes.take_quiet_steps(circuit_, active) : 0;
  for (std::size_t lane = 0; lane < columns.size(); ++lane) {
    const std::size_t i = pixels[lane], at = columns[lane] - begin;
    if ((active >> lane & 1U) != 0) lanes.leave(lane, states_[i]);
    if ((arrived >> lane & 1U) != 0) {
      set_bounds(i, lanes.bounds(lane));
    } else if ((rests >> lane & 1U) == 0) {
      CircuitState unused;
      finish(row, columns[lane], at, lanes.piece(circuit_, lane), 0, lane, unused, buffer);
    }
    keep(i, at, buffer);
  }
}

/// The same for pixels that need several steps.
void CircuitArray::advance_in_several(const Row& row, std::span<const std::uint32_t> columns, std::size_t begin,
                                      CircuitBuffer& buffer) {
  using D = hn::CappedTag<double, CircuitLanes::kLanes>;
  using V = hn::Vec<D>;
  const D d;
  CircuitLanes& lanes = buffer.lanes;
  alignas(64) CircuitLanes::Values light{}, rate{}, lag{}, y{}, v{}, w{}, done{}, leaked{}, next_done{};
  std::array<std::size_t, CircuitLanes::kLanes> pixels{};
  for (std::size_t lane = 0; lane < columns.size(); ++lane) {
    const std::uint32_t column = columns[lane];
    const std::size_t i = row.first + column, at = column - begin;
    pixels[lane] = i;
    if (circuit_.noise) lanes.enter(lane, circuit_, static_cast<std::uint32_t>(i), parameters_[i], states_[i]);
    light[lane] = light_[i], rate[lane] = (buffer.light[at] - light_[i]) / row.length;
    lag[lane] = lag_[i], y[lane] = y_[i], v[lane] = v_[i], w[lane] = w_.empty() ? 0.0 : w_[i];
    const LeakRamp leak = leak_in(row, column, at, buffer);
    leaked[lane] = leak.leaked, lanes.leak_rate[lane] = leak.rate, lanes.light_rate[lane] = rate[lane];
  }
  const auto all = static_cast<CircuitLanes::Lanes>((1U << columns.size()) - 1);
  for (CircuitLanes::Lanes left = all; left != 0;) {
    // The next piece of each pixel, as step_length() and esim::advance() make it
    for (std::size_t i = 0; i < columns.size(); i += hn::Lanes(d)) {
      const V v_done = hn::Load(d, &done[i]), v_rate = hn::Load(d, &rate[i]);
      const V remaining = hn::Sub(hn::Set(d, row.length), v_done);
      const V light0 = hn::MulAdd(v_rate, v_done, hn::Load(d, &light[i]));
      CircuitStates<D> state{light0, hn::Load(d, &lag[i]), hn::Load(d, &y[i]), hn::Load(d, &v[i]), hn::Load(d, &w[i])};
      const CircuitRamps<D> ramp = ramp_of_step(d, circuit_.poles, light0, state.lag, v_rate, remaining);
      const auto ends = hn::Ge(ramp.length, remaining);
      const CircuitPieces<D> piece = esim::advance(d, circuit_.poles, ramp, area_of(d, ramp), state);
      const auto store = [d, i](V values, CircuitLanes::Values& to) { hn::Store(values, d, &to[i]); };
      store(piece.level, lanes.level), store(piece.rate, lanes.rate), store(piece.fast, lanes.fast);
      store(piece.slow, lanes.slow), store(piece.k1, lanes.k1), store(piece.passed, lanes.passed);
      store(ramp.length, lanes.length), store(light0, lanes.light);
      store(hn::Add(hn::Set(d, row.start), v_done), lanes.start), store(hn::Zero(d), lanes.s);
      store(hn::MulAdd(hn::Load(d, &lanes.leak_rate[i]), v_done, hn::Load(d, &leaked[i])), lanes.leaked);
      store(state.lag, lag), store(state.y, y), store(state.v, v), store(state.w, w);
      store(hn::IfThenElse(ends, hn::Set(d, row.length), hn::Add(v_done, ramp.length)), next_done);
    }

    CircuitLanes::Lanes active = 0, inactive = 0, arrived = 0, rests = 0;
    for (std::size_t lane = 0; lane < columns.size(); ++lane) {
      const std::size_t i = pixels[lane];
      if ((left >> lane & 1U) == 0) continue;
      const bool held = states_[i].held_until > lanes.start[lane];
      if (!held && states_[i].active) {
        active |= 1U << lane;
      } else if (is_quiet(lanes, lane, i)) {
        arrived |= 1U << lane;
      } else if (!held && circuit_.noise) {
        inactive |= 1U << lane;
      }
    }
    active |= wake(lanes, pixels, inactive, rests);
    arrived |= rests;
    if (active != 0) arrived |= lanes.take_quiet_steps(circuit_, active);
    for (std::size_t lane = 0; lane < columns.size(); ++lane) {
      if ((left >> lane & 1U) == 0) continue;
      const std::size_t i = pixels[lane], at = columns[lane] - begin;
      const bool was_active = (active >> lane & 1U) != 0, has_arrived = (arrived >> lane & 1U) != 0;
      const bool at_end = next_done[lane] >= row.length;
      CircuitState front{lag[lane], v[lane], w[lane]};
      if (was_active) lanes.leave(lane, states_[i]);
      if (!has_arrived) {
        finish(row, columns[lane], at, lanes.piece(circuit_, lane), done[lane], lane, front, buffer);
      } else if (!at_end) {
        done[lane] = next_done[lane];
        continue;
      } else if (was_active) {
        set_bounds(i, lanes.bounds(lane));
      }
      left &= ~(1U << lane);
      const double last = std::abs(front.lag) < kSettled ? 0.0 : front.lag,
                   settled = buffer.light[at] - std::log1p(last);
      const bool settles = last == 0 && rate[lane] == 0 && std::abs(front.v - settled) < kSettled;
      buffer.lag[at] = last, buffer.y[at] = settled;
      buffer.v[at] = settles ? settled : front.v;
      buffer.w[at] = settles && std::abs(front.v - front.w) < kSettled ? settled : front.w;
      keep(i, at, buffer);
    }
  }
}

/// Takes all pixels of buffer.uncertain to the segment's end; the columns of the buffer begin at `begin`.
void CircuitArray::advance_uncertain(const Row& row, std::size_t begin, CircuitBuffer& buffer) {
  const auto in_groups = [](std::span<const std::uint32_t> columns, const auto& advance_group) {
    for (std::size_t k = 0; k < columns.size(); k += CircuitLanes::count())
      advance_group(columns.subspan(k, std::min(CircuitLanes::count(), columns.size() - k)));
  };
  const auto in_one = [&](std::span<const std::uint32_t> columns) { advance_in_one(row, columns, begin, buffer); };
  in_groups(buffer.uncertain.inactive, in_one);
  in_groups(buffer.uncertain.active, in_one);
  in_groups(buffer.uncertain.several,
            [&](std::span<const std::uint32_t> columns) { advance_in_several(row, columns, begin, buffer); });
}

/// Whether an inactive pixel stays within its bounds during the piece in a lane.
bool CircuitArray::is_quiet(const CircuitLanes& lanes, std::size_t lane, std::size_t i) const {
  const double length = lanes.length[lane], leaked0 = lanes.leaked[lane];
  const double leaked1 = leaked0 + lanes.leak_rate[lane] * length;
  const auto [lowest, highest] = lanes.piece(circuit_, lane).range(0, length);
  const double change = lanes.light[lane] + lanes.light_rate[lane] * length - static_cast<double>(node_light_[i]);
  return lowest + std::min(leaked0, leaked1) - kGuard > low_[i] &&
         highest + std::max(leaked0, leaked1) + kGuard < high_[i] && lanes.start[lane] + length < until_[i] &&
         std::abs(change) < kLightReach;
}

}  // namespace esim::inline event_camera

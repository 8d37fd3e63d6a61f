#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "esim/event_camera/circuit/circuit_pixel.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Active pixels side by side: CircuitPixel::run() as long as nothing happens in any of them, with vectors of floats.
/// Rounding errors make a pixel doubtful at most, and CircuitPixel decides doubtful cases. What a pixel does here does
/// not depend on the others.
struct CircuitLanes {
  static constexpr std::size_t kLanes = PhotoreceptorNoise::kDrawn;
  using Values = std::array<double, kLanes>;
  using Floats = std::array<float, kLanes>;
  using Lanes = std::uint32_t;  ///< one bit per lane

  /// Number of lanes that are used: that of floats in a vector.
  static std::size_t count();

  /// Puts a pixel into a lane.
  void enter(std::size_t lane, const Circuit& circuit, std::uint32_t pixel, const CircuitParameters& parameters,
             const CircuitPixelState& state);

  /// Of inactive pixels: those in which no threshold comes near during their pieces. Their bounds are
  /// resting_bounds().
  Lanes find_resting(const Circuit& circuit, Lanes lanes);

  /// Takes active pixels along their pieces, from `s` on, to the first step of the noise that contains an event
  /// (crossing()), or to the node after which the noise ceases to matter. Returns the pixels that have reached the ends
  /// of their pieces; their bounds are bounds().
  Lanes take_quiet_steps(const Circuit& circuit, Lanes lanes);

  /// The event at which a lane has stopped.
  std::optional<CircuitCrossing> crossing(std::size_t lane) const { return crossings_[lane]; }
  KnownPath& known(std::size_t lane) { return known_[lane]; }

  /// Writes the noise of a lane back.
  void leave(std::size_t lane, CircuitPixelState& state) const;

  CircuitBounds resting_bounds(std::size_t lane, const CircuitParameters& parameters, CircuitPixelState& state) const {
    state.node_light = static_cast<float>(light[lane] + light_rate[lane] * length[lane]);
    const auto reach = static_cast<double>(high_[lane]);
    return {reach - static_cast<double>(parameters.off), static_cast<double>(parameters.on) - reach,
            std::numeric_limits<double>::infinity()};
  }
  CircuitBounds bounds(std::size_t lane) const {
    return {static_cast<double>(-gain_[lane] * low_[lane] - off_[lane]),
            static_cast<double>(on_[lane] - gain_[lane] * high_[lane]), node_time_[lane] + step_[lane]};
  }

  CircuitPiece piece(const Circuit& circuit, std::size_t lane) const {
    return {level[lane],  rate[lane],   fast[lane],
            slow[lane],   k1[lane],     1 / circuit.poles.t2_ns,
            length[lane], passed[lane], circuit.poles.high_pass_per_ns};
  }

  // Per piece: that of CircuitPiece, LightRamp and LeakRamp, and its start in ns after the epoch.
  alignas(64) Values level{}, rate{}, fast{}, slow{}, k1{}, passed{}, length{};
  alignas(64) Values light{}, light_rate{}, leaked{}, leak_rate{}, start{};
  alignas(64) Values s{};  ///< where a pixel is, in ns after the start of its piece

 private:
  struct Signals;

  void use_pole(const PhotoreceptorNoise& noise, std::size_t lane, std::int16_t pole, float node_light);
  void load_step(const PhotoreceptorNoise& noise, std::size_t lane);
  void draw(const Circuit& circuit, Lanes lanes);
  std::optional<CircuitCrossing> find_crossing(const Circuit& circuit, std::size_t lane, double end);

  alignas(64) Values reference_{}, node_time_{}, step_{};
  alignas(64) Floats on_{}, off_{}, gain_{}, inactive_{}, node_light_{}, along_{}, margin_{};
  alignas(64) Floats from_y_{}, from_x_{}, to_y_{}, to_x_{};
  alignas(64) Floats low_{}, high_{};  // bounds of the noise x in the last step; high: reach of the noise at rest
  // Those of PhotoreceptorNoise::Step, of the lanes in has_step_
  alignas(64) std::array<std::array<Floats, 3>, PhotoreceptorNoise::Step::kFactors> parabolas_{};
  alignas(64) Floats xx_{};
  alignas(64) Floats n1_{}, n2_{};  // the last draws
  Lanes has_step_ = 0, is_active_ = 0;
  std::array<const CircuitParameters*, kLanes> parameters_{};
  std::array<std::int16_t, kLanes> poles_{};
  std::array<std::uint32_t, kLanes> pixels_{}, nodes_{}, drawn_{};
  PhotoreceptorNoise::Draws draws_{};
  std::array<std::optional<CircuitCrossing>, kLanes> crossings_{};
  std::array<KnownPath, kLanes> known_{};
};

}  // namespace esim::inline event_camera

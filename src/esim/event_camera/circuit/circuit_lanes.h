#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "esim/event_camera/circuit/circuit_pixel.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Active pixels side by side: CircuitPixel::run() as long as nothing happens in any of them, with vectors. What a
/// pixel does here does not depend on the others.
struct CircuitLanes {
  static constexpr std::size_t kLanes = PhotoreceptorNoise::kDrawn;
  using Values = std::array<double, kLanes>;
  using Lanes = std::uint32_t;  ///< one bit per lane

  /// Number of lanes that are used: that of doubles in a vector.
  static std::size_t count();

  /// Puts a pixel into a lane.
  void enter(std::size_t lane, const Circuit& circuit, std::uint32_t pixel, const CircuitParameters& parameters,
             const CircuitPixelState& state);

  /// Of inactive pixels, from `s` on: those in which no threshold comes near during their pieces. Their bounds are
  /// resting_bounds().
  Lanes find_resting(const Circuit& circuit, Lanes lanes);

  /// Takes active pixels along their pieces, from `s` on, to the beginning of the first step of the noise which
  /// contains an event, or after which the noise ceases to matter. Returns the pixels that have reached the ends of
  /// their pieces; their bounds are bounds().
  Lanes take_quiet_steps(const Circuit& circuit, Lanes lanes);

  /// The event at which a lane has stopped.
  std::optional<CircuitCrossing> crossing(std::size_t lane) const { return crossings_[lane]; }
  KnownPath& known(std::size_t lane) { return known_[lane]; }

  /// Writes the noise of a lane back.
  void leave(std::size_t lane, CircuitPixelState& state) const;

  CircuitBounds resting_bounds(std::size_t lane, const CircuitParameters& parameters, CircuitPixelState& state) const {
    state.node_light = static_cast<float>(light[lane] + light_rate[lane] * length[lane]);
    return {high_[lane] - static_cast<double>(parameters.off), static_cast<double>(parameters.on) - high_[lane],
            std::numeric_limits<double>::infinity()};
  }
  CircuitBounds bounds(std::size_t lane, const CircuitParameters& parameters) const {
    return {-gain_[lane] * low_[lane] - static_cast<double>(parameters.off),
            static_cast<double>(parameters.on) - gain_[lane] * high_[lane], node_time_[lane] + step_[lane]};
  }

  CircuitPiece piece(const Circuit& circuit, std::size_t lane) const {
    return {level[lane],  rate[lane],   fast[lane],
            slow[lane],   k1[lane],     1 / circuit.poles.t2_ns,
            length[lane], passed[lane], circuit.poles.high_pass_per_ns};
  }

  // Per piece: that of CircuitPiece, LightRamp and LeakRamp, and its start in ns after the epoch.
  alignas(64) Values level, rate, fast, slow, k1, passed, length;
  alignas(64) Values light, light_rate, leaked, leak_rate, start;
  alignas(64) Values s;  ///< where a pixel is, in ns after the start of its piece

 private:
  template <class D>
  Lanes take_quiet_steps(D d, const Circuit& circuit, Lanes lanes);
  template <class D>
  Lanes find_resting(D d, const Circuit& circuit, Lanes lanes);
  void use_pole(const PhotoreceptorNoise& noise, std::size_t lane, std::int16_t pole, float node_light);
  void draw(const Circuit& circuit, Lanes lanes, Values& n1, Values& n2);
  std::optional<CircuitCrossing> find_crossing(const Circuit& circuit, std::size_t lane, const SignalAt& from,
                                               const SignalAt& to);

  alignas(64) Values upper_, lower_, gain_, inactive_, node_light_;
  alignas(64) Values from_y_, from_x_, to_y_, to_x_, node_time_, step_, decay_, along_, margin_;
  alignas(64) std::array<std::int64_t, kLanes> steps_;  // of PhotoreceptorNoise, in doubles
  alignas(64) Values low_, high_;  // bounds of the noise x in the last step; high: reach of the noise at rest
  std::array<const CircuitParameters*, kLanes> parameters_;
  std::array<double, kLanes> references_;
  std::array<std::int16_t, kLanes> poles_;
  std::array<std::uint32_t, kLanes> pixels_, nodes_, drawn_;
  PhotoreceptorNoise::Draws draws_;
  std::array<std::optional<CircuitCrossing>, kLanes> crossings_;
  std::array<KnownPath, kLanes> known_;
};

}  // namespace esim::inline event_camera

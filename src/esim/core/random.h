#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace esim::inline core {

/// What a random number is used for. Results depend on the values: never renumber them.
enum class Purpose : std::uint16_t {
  threshold_mismatch = 1,
  threshold_noise = 2,
  trajectory_position = 3,
  trajectory_rotation = 4,
  leak_mismatch = 5,
  pixel_defects = 6,
  shot_noise = 7,
  sampling_audit = 8,
  dataset_image = 9,
  dataset_motion = 10,
  dataset_sensor = 11,
  dataset_choice = 12,
  dead_leaves = 13,
  frame_noise = 16,
  imu_noise = 20,
  imu_bias = 21,
  circuit_noise = 24,
  circuit_mismatch = 25,
  circuit_start = 26,
  resampling = 27,
  sensor_choice = 28,
  circuit_readout = 29,
  test = 1000,
};

/// Addressed random numbers: every draw is a pure function of (seed, purpose, stream, item, draw), computed with the
/// counter-based generator Philox4x32-10 (Salmon et al., SC 2011). There is no state, so that results depend neither on
/// the order of calls nor on threads or other draws.
///
/// `stream` separates cameras (or moving bodies), `item` pixels (or axes), `draw` successive draws of one item.
class AddressedRandom {
 public:
  AddressedRandom(std::uint64_t seed, Purpose purpose, std::uint16_t stream = 0);

  /// Four independent uniform 32-bit words.
  std::array<std::uint32_t, 4> bits(std::uint32_t item, std::uint64_t draw = 0) const;

  /// bits(items[i], draws[i]) for many items: word k of the i-th in words[k][i]. All arrays are read and written up to
  /// `count` rounded up to a multiple of 16, and must have that size.
  void bits(std::size_t count, const std::uint32_t* items, const std::uint32_t* draws,
            const std::array<std::uint32_t*, 4>& words) const;

  /// A uniform deviate on the open interval (0, 1) from 53 bits of two words.
  static double open_unit(std::uint32_t high, std::uint32_t low) {
    const std::uint64_t word = (static_cast<std::uint64_t>(high) << 32) | low;
    return (static_cast<double>(static_cast<std::int64_t>(word >> 11)) + 0.5) * 0x1.0p-53;
  }

  /// Two independent uniform deviates on (0, 1), 53 bits each, from the first two and the last two words of bits().
  std::array<double, 2> uniforms(std::uint32_t item, std::uint64_t draw = 0) const;

  /// Two independent standard normal deviates (Box-Muller).
  std::array<double, 2> normals(std::uint32_t item, std::uint64_t draw = 0) const;

 private:
  std::array<std::uint32_t, 2> key_;
  std::uint32_t address_;
};

}  // namespace esim::inline core

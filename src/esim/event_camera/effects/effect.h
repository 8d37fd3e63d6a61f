// Divides next_event() and draw_parameters() of reference.cpp into effects on a block of pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "esim/core/per_pixel.h"
#include "esim/core/pixel_normals.h"
#include "esim/core/random.h"
#include "esim/event_camera/pixel/pixel_block.h"

// What effects on the pixels have in common.
// Private to event_camera.
namespace esim::inline event_camera {

/// The fixed parameters of a pixel.
struct PixelParameters {
  std::uint32_t pixel;                 ///< index
  double threshold_on, threshold_off;  ///< of the camera
  float on, off;                       ///< the pixel's, relative to these two; infinite if it is dead
  bool dead;
  float drift = 0;  ///< of the comparator's signal until its first event, 1/s: set by the effect that causes it
};

/// The active pixels of a block in one round, in which each fires at most once. Times are in ns after the segment's
/// start.
struct Round {
  const ActivePixels* active = nullptr;
  double duration = 0;           ///< of the segment
  double max_delay = 0;          ///< that a time stamp may have
  Comparators compare{};         ///< in find(): the crossings, which an earlier event may replace
  PixelNormals normals{};        ///< four deviates for each event: ON and OFF threshold, leak, latency
  PerPixel<double> passed{};     ///< the level that the event crossed: the new reference
  PerPixel<double> restarts{};   ///< 1: the new reference is the current signal instead
  PerPixel<double> stamp{};      ///< time stamp of the event
  PerPixel<std::uint8_t> own{};  ///< 1: the event is an effect's own, not a crossing; only valid with labels
};

/// An effect on the pixels after the low-pass: its options, its state per pixel, its contribution to the signal and its
/// events. Derive from it, define `State`, `Lanes`, a constructor (options, seed, stream) and those of the functions
/// below that the effect needs, and add the class to the list in effects.h. The functions here do nothing.
///
/// An effect that needs random numbers addresses them by a Purpose of its own, one of Purpose{40} to Purpose{79}.
///
/// State: the values of one pixel, kept from segment to segment, with times in ns after the camera's epoch. Lanes: the
/// same for the pixels of a block, with times in ns after the segment's start.
struct PixelEffect {
  bool active = false;  ///< with the camera's options
  bool timer = false;   ///< it makes pixels fire at constant irradiance
  bool draws = false;   ///< it uses Round::normals

  /// make(state, parameters): sets the fixed parameters of a pixel, its State and `drift`.
  template <class... T>
  static void make(const T&...) {}
  /// take(lanes, i, state, epoch_ns), store(lanes, i, state, epoch_ns): copies a pixel into a block, and back.
  /// epoch_ns: from the epoch to the segment's start.
  template <class... T>
  static void take(const T&...) {}
  template <class... T>
  static void store(const T&...) {}
  /// keep(lanes, i, to): moves a pixel within the block.
  template <class... T>
  static void keep(const T&...) {}

  /// open(lanes, round): at the first sample, after the references have been set.
  template <class... T>
  static void open(const T&...) {}
  /// find(lanes, round): replaces crossings by earlier events of its own, and sets `restarts` and `own` for these.
  template <class... T>
  static void find(const T&...) {}
  /// renew(lanes, round): draws the parameters that hold after the event, such as thresholds and `drift`. If it changes
  /// the drift, it must also change `passed`, so that the signal is continuous.
  template <class... T>
  static void renew(const T&...) {}
  /// delay(lanes, round): delays the time stamps.
  template <class... T>
  static void delay(const T&...) {}

  /// next(lanes, i): the time of the next event of its own, which makes the pixel active.
  template <class Lanes>
  static double next(const Lanes&, std::size_t) {
    return kNeverNs;
  }
  /// take_back(state, pixel, until): reverts to its state of an earlier time, `until`, ns after the epoch.
  template <class... T>
  static void take_back(const T&...) {}
};

/// random.uniforms(pixel, draw)[0] for each active pixel.
inline PerPixel<double> draw_uniforms(const AddressedRandom& random, const ActivePixels& active, std::uint32_t draw) {
  std::array<PerPixel<std::uint32_t>, 4> words;
  PerPixel<std::uint32_t> draws;
  PerPixel<double> uniforms;
  draws.fill(draw);
  random.bits(active.count, active.pixel.data(), draws.data(),
              {words[0].data(), words[1].data(), words[2].data(), words[3].data()});
  for (std::size_t i = 0; i < active.count; ++i) uniforms[i] = AddressedRandom::open_unit(words[0][i], words[1][i]);
  return uniforms;
}

}  // namespace esim::inline event_camera

#pragma once

#include <array>

#include "esim/core/describe.h"

namespace esim::inline light {

/// How a light varies over a period.
enum class FlickerShape {
  mains,  ///< |sin|: lamps on mains; darkest at the start of the period
  sine,   ///< darkest at the start of the period
  pwm,    ///< on from the start of the period for a fraction `duty` of it, then off
};

/// The periodic modulation of a light. It does not change the mean of the light over a period.
struct FlickerOptions {
  double frequency_hz = 100.0;
  double depth = 0.5;  ///< 1 - minimum / maximum
  FlickerShape shape = FlickerShape::mains;
  double duty = 0.5;
  double phase = 0.0;  ///< of the light at time 0 of the trajectory's clock, in periods
};

template <class Visitor>
void describe(Visitor& visit, FlickerOptions& o) {
  visit("frequency_hz", o.frequency_hz,
        About{"frequency of the light; lamps on mains flicker at twice its frequency: 100 or 120", "Hz", 0, 1e6, true});
  visit("depth", o.depth, About{"1 - minimum / maximum of the light: 0 is constant, 1 goes dark", "", 0, 1});
  visit("shape", o.shape,
        About{"mains: |sin|; sine; pwm: switched on and off. mains and sine are darkest at phase 0, pwm switches on"});
  visit("duty", o.duty, About{"with shape pwm: fraction of the period for which the light is on", "", 0, 1});
  visit("phase", o.phase, About{"phase at time 0 of the trajectory's clock, as a fraction of the period", "", 0, 1});
}

}  // namespace esim::inline light

namespace esim {

template <>
inline constexpr std::array<const char*, 3> kEnumNames<FlickerShape>{"mains", "sine", "pwm"};

}  // namespace esim

#pragma once

#include "esim/preview/colours.h"

namespace esim::inline visualise {

/// Colours around and behind the events.
struct Theme {
  Rgb page{13, 15, 20};          ///< around the panels
  Rgb ground{24, 27, 34};        ///< background, without events
  Rgb ink{226, 229, 235};        ///< text
  Rgb faint_ink{142, 150, 163};  ///< less important text, and axes
  Rgb grid{52, 58, 70};
};

inline constexpr Theme kDarkTheme{};
inline constexpr Theme kLightTheme{{255, 255, 255}, {246, 247, 249}, {30, 30, 30}, {110, 110, 110}, {214, 217, 222}};

}  // namespace esim::inline visualise

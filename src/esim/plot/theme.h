#pragma once

#include "esim/plot/colour.h"

namespace esim::inline plot {

/// Colours of everything in a figure but its data.
struct Theme {
  Rgb page{13, 15, 20};          ///< around the panels
  Rgb ground{24, 27, 34};        ///< background of a panel without data
  Rgb ink{226, 229, 235};        ///< text
  Rgb faint_ink{142, 150, 163};  ///< less important text, and axes
  Rgb grid{52, 58, 70};
};

inline constexpr Theme kDarkTheme{};
inline constexpr Theme kLightTheme{{255, 255, 255}, {246, 247, 249}, {30, 30, 30}, {100, 100, 100}, {226, 228, 231}};

// Colours of data on the light theme.
inline constexpr Rgb kBarColour{86, 112, 138};
inline constexpr Rgb kHighlightColour{208, 32, 52};

// Heights of capitals, px.
inline constexpr int kHeadlineHeight = 14, kTitleHeight = 12, kTextHeight = 10;

}  // namespace esim::inline plot

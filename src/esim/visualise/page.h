#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "esim/plot/theme.h"
#include "esim/recording/format.h"

namespace esim::inline visualise {

/// What a panel shows.
enum class View { events, time_surface, space_time, image, depth, motion };
inline constexpr int kViews = 6;

/// "time-surface", as in `--view`, and the title "Time surface".
std::string_view name_of(View view);
std::string_view title_of(View view);

/// The layout of equal panels for a sensor of this size, with a line of text above and below each: one row for up to
/// three panels, two rows for more. Width and height are even, as video requires.
struct PageLayout {
  /// `width` is the approximate width of the page, px; 0: automatic, 960 to 1920 px.
  PageLayout(const std::vector<View>& views, SensorSize sensor, int width = 0);

  std::vector<View> views;
  int columns = 1, rows = 1;
  int panel_width = 0, panel_height = 0;
  int width = 0, height = 0;

  /// The area of a panel, by its index in `views`.
  Tile panel(std::size_t index) const;
};

/// The content of a panel.
struct Panel {
  Image<Rgb> picture{};  ///< of any size; it is scaled to the panel
  std::string note{};    ///< to the right of the title

  // Legends below the panel: for polarities, for depth (if near_m > 0), for motion (if its full scale is > 0).
  bool polarities = false;
  float near_m = 0, far_m = 0;
  float full_speed_px_per_s = 0;
};

/// Draws the panels in the layout's order, below a headline on the left and one on the right.
Image<Rgb> draw_page(const PageLayout& layout, const std::vector<Panel>& panels, const std::string& left,
                     const std::string& right, const Theme& theme);

/// An image of a contact sheet, with a line of text above it.
struct CaptionedPicture {
  Image<Rgb> picture{};
  std::string caption{};
};

/// Arranges images of equal size in rows of `columns`; an empty image without any.
Image<Rgb> draw_contact_sheet(const std::vector<CaptionedPicture>& pictures, int columns, const Theme& theme);

}  // namespace esim::inline visualise

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "esim/record/format.h"
#include "esim/record/preview/canvas.h"
#include "esim/visualise/theme.h"

namespace esim {

/// What a panel shows.
enum class View { events, time_surface, space_time, image, depth, motion };
inline constexpr int kViews = 6;

/// "time-surface", as in `--view`; and for people: "Time surface".
std::string_view name_of(View view);
std::string_view title_of(View view);

/// Where equal panels go, with a line of text above and one below each, for a sensor of this size: in one row, or in
/// two of more than three. Width and height are even, as video wants them.
struct PageLayout {
  /// `width` is about that of the whole, px; at 0 it is chosen: 960 to 1920 px.
  PageLayout(const std::vector<View>& views, SensorSize sensor, int width = 0);

  std::vector<View> views;
  int columns = 1, rows = 1;
  int panel_width = 0, panel_height = 0;
  int width = 0, height = 0;

  /// The place of a panel, by its index in `views`.
  Tile panel(std::size_t index) const;
};

/// One panel's content.
struct Panel {
  Image<Rgb> picture{};  ///< of any size; it is enlarged or reduced to the panel's
  std::string note{};    ///< to the right of the title

  // Legends below, where the colours are those of polarities, of depth (near above 0), or of motion (above 0).
  bool polarities = false;
  float near_m = 0, far_m = 0;
  float full_flow_px_per_s = 0;
};

/// The panels in the layout's order, below a headline at the left and another one at the right.
Image<Rgb> draw_page(const PageLayout& layout, const std::vector<Panel>& panels, const std::string& left,
                     const std::string& right, const Theme& theme);

/// A picture of a contact sheet, with a line of text above it.
struct CaptionedPicture {
  Image<Rgb> picture{};
  std::string caption{};
};

/// Pictures of one size in rows of `columns`; nothing of none.
Image<Rgb> draw_contact_sheet(const std::vector<CaptionedPicture>& pictures, int columns, const Theme& theme);

}  // namespace esim

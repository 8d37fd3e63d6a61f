#pragma once

#include <cstdint>
#include <string>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/preview/colours.h"

namespace esim::inline preview {

/// The contents of one frame of the preview. The images are borrowed and have the size of the camera.
struct PreviewFrame {
  TimeNs t = 0;
  TimeNs since_previous = 0;      ///< time in which the events were counted; 0: first frame
  const Image<float>& on_events;  ///< events per pixel
  const Image<float>& off_events;
  const Image<float>& irradiance;
  const Image<float>* depth_m = nullptr;  ///< null, like the motion field, if only images are known
  const Image<float>* motion_x_px_per_s = nullptr;
  const Image<float>* motion_y_px_per_s = nullptr;
  float near_m = 0, far_m = 0;    ///< range of the depth colours; 0: no depth is known
  float full_speed_px_per_s = 1;  ///< full scale of the motion-field colours
  std::string caption{};          ///< text above the panels, on the right
};

/// The layout of panels and captions for a camera of this size: events, depth and motion field, or events and image.
/// Panels are at least 320 px wide, enlarged by an integer factor if possible, and together at most 1920 px wide. Width
/// and height are even, as video encoders require.
struct PreviewLayout {
  PreviewLayout(int camera_width, int camera_height, int panels = 3);

  int panels = 3;
  int panel_width = 0, panel_height = 0;
  int column_width = 0;  // width of a panel and its legend
  int width = 0, height = 0;

  int panel_x(int panel) const;
  int panel_y() const;
  int legend_y() const;
};

/// Draws the frames of one video, which share their size and caption: the panels side by side, with legends. The static
/// parts are drawn once.
class PreviewPage {
 public:
  explicit PreviewPage(const PreviewLayout& layout) : layout_(layout) {}

  Image<Rgb> compose(const PreviewFrame& frame);

 private:
  /// Draws the numbers of the legends.
  struct Scales {
    float near_m = 0, far_m = 0, full_speed_px_per_s = 0;
    bool operator==(const Scales&) const = default;
  };

  PreviewLayout layout_;
  Scales scales_;
  Image<Rgb> backdrop_;
};

}  // namespace esim::inline preview

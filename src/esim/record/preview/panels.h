#pragma once

#include <cstdint>
#include <string>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// What one frame of the preview shows. The images are borrowed, of the camera's size.
struct PreviewFrame {
  TimeNs t = 0;
  TimeNs since_previous = 0;      ///< over which the events were counted; 0: none before
  const Image<float>& on_events;  ///< number per pixel
  const Image<float>& off_events;
  const Image<float>& irradiance;
  const Image<float>* depth_m = nullptr;  ///< null, like the motion field, where only images are known
  const Image<float>* flow_x_px_per_s = nullptr;
  const Image<float>* flow_y_px_per_s = nullptr;
  float near_m = 0, far_m = 0;   ///< of the depth's colours; 0: no depth is known
  float full_flow_px_per_s = 1;  ///< of the motion field's colours
  std::string caption{};         ///< to the right above the panels
};

/// Where the panels and their captions go, for a camera of this size: events, depth and motion field, or events and
/// image. Panels are at least 320 px wide, by a whole
/// factor where possible, and all together at most 1920 px. Width and height are even, as video wants them.
struct PreviewLayout {
  PreviewLayout(int camera_width, int camera_height, int panels = 3);

  int panels = 3;
  int panel_width = 0, panel_height = 0;
  int column_width = 0;  // of a panel and its legend
  int width = 0, height = 0;

  int panel_x(int panel) const;
  int panel_y() const;
  int legend_y() const;
};

/// Makes pictures of the frames of one video, which share their size and caption: the panels side by side, with their
/// legends. What stays the same is drawn once.
class PreviewPage {
 public:
  explicit PreviewPage(const PreviewLayout& layout) : layout_(layout) {}

  Image<Rgb> compose(const PreviewFrame& frame);

 private:
  /// What the legends say.
  struct Scales {
    float near_m = 0, far_m = 0, full_flow_px_per_s = 0;
    bool operator==(const Scales&) const = default;
  };

  PreviewLayout layout_;
  Scales scales_;
  Image<Rgb> backdrop_;
};

}  // namespace esim

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"

/// Events as arrays, for networks and for people. Events need not be in order unless that is said. All functions throw
/// UserError for sizes that are none, and for events outside the sensor, naming the first.
namespace esim {

/// Images of one size, one after the other, row by row.
template <typename T>
struct ImageStack {
  int count = 0, height = 0, width = 0;
  std::vector<T> values{};  ///< count x height x width
};

/// The events of each pixel, counted: an image for ON, then one for OFF.
ImageStack<std::int32_t> count_events(EventSpan events, int width, int height);

/// Which time stamp stands for the events of a pixel.
enum class StampChoice { last, mean };

/// Four images: the number of ON and of OFF events, as floats, and a time stamp of the ON and of the OFF events, their
/// last or their mean one, (t - start) / (end - start), 0 where there are none. With the last one that is the input of
/// EV-FlowNet (Zhu et al., RSS 2018, Section III-A), which the paper takes for learning optical flow (Section 5).
/// Events outside the span are passed over. Where it has no length, the stamps are 0.
ImageStack<float> count_and_stamp(EventSpan events, int width, int height, const TimeSpan& span, StampChoice stamp);

/// `bins` images over the span (Zhu et al., "Unsupervised Event-based Learning of Optical Flow, Depth, and Egomotion",
/// CVPR 2019, Eqs. 1 and 2): with polarity p = +1 or -1,
///   V(b, y, x) = sum of p max(0, 1 - |b - t*|) over the pixel's events,   t* = (bins - 1) (t - start) / (end - start).
/// Events outside the span are passed over. Where it has no length, t* is 0.
ImageStack<float> voxel_grid(EventSpan events, int width, int height, int bins, const TimeSpan& span);

/// Brings the values that are not 0 to a mean of 0 and a standard deviation of 1, as networks like them (Rebecq et al.,
/// E2VID, CVPR 2019); if they are all the same, to 0. Values that are 0 stay so.
void standardise(std::span<float> values);

/// exp(-(t - t_last) / tau) with t_last the time of the pixel's last event until t, an image for ON and one for OFF; 0
/// where there is none (the exponential time surface of Lagorce et al., "HOTS", PAMI 2017). tau > 0 in s.
ImageStack<float> time_surface(EventSpan events, int width, int height, TimeNs t, double tau_s);

using Colour = std::array<std::uint8_t, 3>;

struct FramePalette {
  Colour on{}, off{}, background{};
};

/// A picture for people, height x width x 3: each pixel in the colour of the last of its events, as they are listed.
std::vector<std::uint8_t> event_frame(EventSpan events, int width, int height, const FramePalette& palette);

}  // namespace esim

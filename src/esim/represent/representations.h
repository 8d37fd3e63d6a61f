#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"

/// Events as arrays, for networks and for display. Events may be in any order unless stated otherwise. All functions
/// throw UserError for invalid sizes, and for events outside the sensor, naming the first.
namespace esim::inline represent {

/// Images of one size, stored one after the other, row by row.
template <typename T>
struct ImageStack {
  int count = 0, height = 0, width = 0;
  std::vector<T> values{};  ///< count x height x width
};

/// The number of events of each pixel: one image for ON, then one for OFF.
ImageStack<std::int32_t> count_events(EventSpan events, int width, int height);

/// Which time stamp represents the events of a pixel.
enum class StampChoice { last, mean };

/// Four images: the numbers of ON and of OFF events, as floats, and the last or mean time stamp of the ON and of the
/// OFF events, (t - start) / (end - start), 0 without events. With the last time stamp this is the input of EV-FlowNet
/// (Zhu et al., RSS 2018, Section III-A), which the paper uses to learn optical flow (Section 5). Events outside the
/// span are ignored. If the span has no length, the stamps are 0.
ImageStack<float> count_and_stamp(EventSpan events, int width, int height, const TimeSpan& span, StampChoice stamp);

/// `bins` images over the span (Zhu et al., "Unsupervised Event-based Learning of Optical Flow, Depth, and Egomotion",
/// CVPR 2019, Eqs. 1 and 2): with polarity p = +1 or -1,
///   V(b, y, x) = sum of p max(0, 1 - |b - t*|) over the pixel's events,   t* = (bins - 1) (t - start) / (end - start).
/// Events outside the span are ignored. If the span has no length, t* is 0.
ImageStack<float> voxel_grid(EventSpan events, int width, int height, int bins, const TimeSpan& span);

/// Normalises the nonzero values to mean 0 and standard deviation 1, as for networks (Rebecq et al., E2VID, CVPR 2019);
/// to 0 if they are all equal. Zeros stay 0.
void standardise(std::span<float> values);

/// exp(-(t - t_last) / tau), where t_last is the time of the pixel's last event until t; 0 without one. One image for
/// ON and one for OFF (the exponential time surface of Lagorce et al., "HOTS", PAMI 2017). tau > 0 in s.
ImageStack<float> time_surface(EventSpan events, int width, int height, TimeNs t, double tau_s);

using Colour = std::array<std::uint8_t, 3>;

struct FramePalette {
  Colour on{}, off{}, background{};
};

/// An image for display, height x width x 3: each pixel has the colour of its last event in the list.
std::vector<std::uint8_t> event_frame(EventSpan events, int width, int height, const FramePalette& palette);

}  // namespace esim::inline represent

#include "esim/visualise/space_time.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "esim/plot/scale.h"
#include "esim/visualise/dots.h"

namespace esim::inline visualise {
namespace {

constexpr double kTimeLength = 1.5;    // of the box; all lengths are in units of the sensor's longer side
constexpr double kViewerDistance = 5;  // from the middle of the box
constexpr double kMiddleYaw_deg = -40, kSwing_deg = 18, kPitch_deg = 19;
constexpr double kLabelSpace = 50;  // px around the box
constexpr float kNewOpacity = 0.95f, kOldOpacity = 0.45f;
constexpr float kFade = 0.45f;   // of the most distant points towards the background
constexpr double kRecent = 0.1;  // fraction of the time in which points lose most of their opacity

// A point relative to the middle of the box: right, down, and away from a viewer along the time axis.
struct Point {
  double x = 0, y = 0, z = 0;
};

Point half_extent(SensorSize sensor) {
  const double longer = std::max(sensor.width, sensor.height);
  return {0.5 * sensor.width / longer, 0.5 * sensor.height / longer, 0.5 * kTimeLength};
}

// Its projection at scale 1.
struct Seen {
  double u = 0, v = 0, distance = 0;
};

Seen see(const Point& point, const ViewTurn& turn) {
  const double right = point.x * turn.cos_yaw + point.z * turn.sin_yaw;
  const double away = point.z * turn.cos_yaw - point.x * turn.sin_yaw;
  const double down = point.y * turn.cos_pitch - away * turn.sin_pitch;
  const double distance = kViewerDistance + point.y * turn.sin_pitch + away * turn.cos_pitch;
  return {right * kViewerDistance / distance, down * kViewerDistance / distance, distance};
}

// One of the eight corners: bits 0, 1, 2 select the larger x, y, z.
Point corner(const Point& half, int index) {
  return {(index & 1) != 0 ? half.x : -half.x, (index & 2) != 0 ? half.y : -half.y,
          (index & 4) != 0 ? half.z : -half.z};
}

/// A colour that fades to the background with depth, 0 to 1.
class FadedColours {
 public:
  FadedColours(Rgb colour, Rgb ground) {
    for (std::size_t i = 0; i < colours_.size(); ++i)
      colours_[i] = mix(colour, ground, kFade * static_cast<float>(i) / static_cast<float>(colours_.size() - 1));
  }
  Rgb at(float depth) const {
    return colours_[static_cast<std::size_t>(std::clamp(depth, 0.0f, 1.0f) * static_cast<float>(colours_.size() - 1) +
                                             0.5f)];
  }

 private:
  std::array<Rgb, 256> colours_;
};

/// The box, its axes and its content.
class Plot {
 public:
  Plot(const SpaceTimeBox& box, const SpaceTimeView& view, int width, int height, const Theme& theme)
      : box_(box),
        theme_(theme),
        projection_(box, view, {0, 0, width, height}),
        canvas_(width, height, theme.ground),
        axes_{{{"x (px)", linear_ticks(0, box.sensor.width).major, -0.5, box.sensor.width - 0.5},
               {"y (px)", linear_ticks(0, box.sensor.height).major, -0.5, box.sensor.height - 0.5},
               {"t (s)", time_ticks(box), double(box.start), double(box.end)}}} {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Of two opposite sides, the one whose middle is farther away is behind the content.
      std::array<double, 3> low = middle(), high = middle();
      low[axis] = axes_[axis].low;
      high[axis] = axes_[axis].high;
      const bool low_is_farther = place(low).distance > place(high).distance;
      back_[axis] = low_is_farther ? axes_[axis].low : axes_[axis].high;
      front_[axis] = low_is_farther ? axes_[axis].high : axes_[axis].low;
    }
  }

  void draw_back() {
    std::vector<Stroke> grid, edges, far_edges;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // On the two back sides that are parallel to this axis.
      for (const std::size_t other : {(axis + 1) % 3, (axis + 2) % 3}) {
        for (const Tick& tick : axes_[axis].ticks) {
          const double at = value_of(axis, tick);
          if (!is_within(axis, at)) continue;
          std::array<double, 3> from = back_;
          from[axis] = at;
          grid.push_back(along(other, from));
        }
        std::array<double, 3> from = back_;
        from[other] = front_[other];
        edges.push_back(along(axis, from));
      }
      far_edges.push_back(along(axis, back_));
    }
    canvas_.strokes(grid, 1, theme_.grid);
    canvas_.strokes(edges, 1, mix(theme_.grid, theme_.faint_ink, 0.6f));
    canvas_.strokes(far_edges, 1, mix(theme_.grid, theme_.faint_ink, 0.3f));
  }

  void draw_points(EventSpan events) {
    std::vector<Dot> dots;
    dots.reserve(events.size());
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
    for (int i = 0; i < 8; ++i) {
      const double distance =
          place({(i & 1) != 0 ? axes_[0].low : axes_[0].high, (i & 2) != 0 ? axes_[1].low : axes_[1].high,
                 (i & 4) != 0 ? axes_[2].low : axes_[2].high})
              .distance;
      nearest = std::min(nearest, distance);
      farthest = std::max(farthest, distance);
    }
    const FadedColours on(kOnColour, theme_.ground), off(kOffColour, theme_.ground);
    const auto per_length = static_cast<float>(1 / (static_cast<double>(box_.end - box_.start) * kRecent));
    for (const Event& event : events) {
      if (event.t < box_.start || event.t > box_.end) continue;
      const SpaceTimeProjection::Place seen = projection_.place(event.x, event.y, static_cast<double>(event.t));
      const auto depth = static_cast<float>((seen.distance - nearest) / (farthest - nearest));
      const float recent = std::exp(-static_cast<float>(box_.end - event.t) * per_length);
      const float opacity = kOldOpacity + (kNewOpacity - kOldOpacity) * recent;
      dots.push_back({static_cast<float>(seen.spot.x), static_cast<float>(seen.spot.y),
                      static_cast<float>(std::clamp(0.62 * seen.scale, 0.75, 8.0)), depth,
                      (event.polarity > 0 ? on : off).at(depth), static_cast<std::uint16_t>(256 * opacity + 0.5f)});
    }
    Image<Rgb> pixels = std::move(canvas_).take();
    draw_dots(dots, pixels);
    canvas_ = Canvas(std::move(pixels));
  }

  void draw_labels() {
    // The labels of x and time are at the lower front edges, those of y at the leftmost edge.
    const double bottom = axes_[1].high;
    label_axis(0, {0, bottom, front_[2]}, std::array{0.0, 0.0, front_[2] - back_[2]});
    label_axis(2, {front_[0], bottom, 0}, std::array{front_[0] - back_[0], 0.0, 0.0});
    std::array<double, 3> leftmost{};
    double min = std::numeric_limits<double>::infinity();
    for (const double x : {axes_[0].low, axes_[0].high}) {
      for (const double t : {axes_[2].low, axes_[2].high}) {
        const double column = place({x, bottom, t}).spot.x;
        if (column < min) leftmost = {x, 0, t};
        min = std::min(min, column);
      }
    }
    label_axis(1, leftmost, std::nullopt);
  }

  Image<Rgb> take() && { return std::move(canvas_).take(); }

 private:
  struct Axis {
    std::string title;
    std::vector<Tick> ticks;
    double low = 0, high = 1;
  };

  static std::vector<Tick> time_ticks(const SpaceTimeBox& box) {
    constexpr int kWanted = 6;
    const double low = to_seconds(box.start - box.origin), high = to_seconds(box.end - box.origin);
    const bool too_fine = high - low < 1e-9 * std::max(std::abs(low), std::abs(high));  // for tick labels
    return too_fine ? std::vector<Tick>{} : linear_ticks(low, high, kWanted, LabelStyle::full).major;
  }

  // Ticks of the time axis are labelled in seconds, but placed in ns.
  double value_of(std::size_t axis, const Tick& tick) const {
    return axis == 2 ? static_cast<double>(box_.origin) + 1e9 * tick.value : tick.value;
  }
  std::array<double, 3> middle() const {
    return {0.5 * (axes_[0].low + axes_[0].high), 0.5 * (axes_[1].low + axes_[1].high),
            0.5 * (axes_[2].low + axes_[2].high)};
  }
  SpaceTimeProjection::Place place(const std::array<double, 3>& at) const {
    return projection_.place(at[0], at[1], at[2]);
  }
  bool is_within(std::size_t axis, double at) const { return at >= axes_[axis].low && at <= axes_[axis].high; }
  /// The line through `at` along an axis.
  Stroke along(std::size_t axis, const std::array<double, 3>& at) const {
    std::array<double, 3> from = at, to = at;
    from[axis] = axes_[axis].low;
    to[axis] = axes_[axis].high;
    return {place(from).spot, place(to).spot};
  }

  double tick_step(std::size_t axis) const {
    const std::vector<Tick>& ticks = axes_[axis].ticks;
    return ticks.size() > 1 ? ticks[1].value - ticks[0].value : 1;
  }

  int widest_label(std::size_t axis) const {
    int widest = 0;
    for (const Tick& tick : axes_[axis].ticks) widest = std::max(widest, Canvas::text_width(tick.label, kTextHeight));
    return widest;
  }

  /// The number of ticks from one label to the next, so that labels fit and are multiples of 1, 2 or 5 times a power of
  /// ten; the same ticks keep labels as time advances.
  long labelled_ticks(std::size_t axis, const Stroke& edge) const {
    const double across = std::abs(edge[1].x - edge[0].x), down = std::abs(edge[1].y - edge[0].y);
    const double step = tick_step(axis);
    const long mantissa = std::lround(step / std::pow(10.0, std::floor(std::log10(step) + 1e-6)));
    const double spaces = extent(axis) / step;
    long every = 1;
    for (const long candidate : {1, 2, 4, 5, 10, 20}) {
      const long leading = mantissa * candidate;
      if (leading != 1 && leading != 2 && leading != 5 && leading % 10 != 0) continue;
      every = candidate;
      const double fraction = static_cast<double>(every) / spaces;
      if (fraction * across > widest_label(axis) + kTextHeight || fraction * down > 1.8 * kTextHeight) break;
    }
    return every;
  }
  /// The extent of an axis in the unit of its labels.
  double extent(std::size_t axis) const { return (axes_[axis].high - axes_[axis].low) * (axis == 2 ? 1e-9 : 1.0); }

  // Draws ticks and title of an axis along an edge, in the direction `outward`, or to the left without it.
  void label_axis(std::size_t axis, std::array<double, 3> edge, std::optional<std::array<double, 3>> outward) {
    const auto direction = [&](const std::array<double, 3>& at) {
      if (!outward) return Spot{-1, 0};
      std::array<double, 3> beyond = at;
      for (std::size_t i = 0; i < 3; ++i) beyond[i] += 0.05 * (*outward)[i];
      const Spot from = place(at).spot, to = place(beyond).spot;
      const double length = std::max(std::hypot(to.x - from.x, to.y - from.y), 1e-9);
      return Spot{(to.x - from.x) / length, (to.y - from.y) / length};
    };
    const auto write = [&](double at, double away, const std::string& text, Rgb colour) {
      edge[axis] = at;
      const Spot spot = place(edge).spot, out = direction(edge);
      const Align align = out.x < -0.7 ? Align::right : out.x > 0.7 ? Align::left : Align::centre;
      canvas_.text(static_cast<int>(std::lround(spot.x + away * out.x)),
                   static_cast<int>(std::lround(spot.y + away * out.y)) + kTextHeight / 2 + (outward ? 3 : 0), text,
                   kTextHeight, colour, align);
    };
    const Stroke whole = along(axis, edge);
    const long every = labelled_ticks(axis, whole);
    std::vector<Stroke> lines = {whole};
    for (const Tick& tick : axes_[axis].ticks) {
      const double at = value_of(axis, tick);
      if (!is_within(axis, at)) continue;
      edge[axis] = at;
      const Spot spot = place(edge).spot, out = direction(edge);
      lines.push_back({spot, Spot{spot.x + 4 * out.x, spot.y + 4 * out.y}});
      const bool at_corner = axis == 2 && at - axes_[axis].low < 0.04 * (axes_[axis].high - axes_[axis].low);
      if (at_corner) continue;  // the labels of y end here
      if (every > 1 && std::lround(tick.value / tick_step(axis)) % every != 0) continue;
      write(at, 11, tick.label, theme_.ink);
    }
    canvas_.strokes(lines, 1, theme_.faint_ink);
    if (outward) {
      write(middle()[axis], 28 + 0.7 * widest_label(axis), axes_[axis].title, theme_.faint_ink);
    } else {
      const Spot top = whole[0];
      canvas_.text(static_cast<int>(top.x), static_cast<int>(top.y) - 14, axes_[axis].title, kTextHeight,
                   theme_.faint_ink, Align::centre);
    }
  }

  SpaceTimeBox box_;
  Theme theme_;
  SpaceTimeProjection projection_;
  Canvas canvas_;
  std::array<Axis, 3> axes_;                // x, y, time
  std::array<double, 3> back_{}, front_{};  // ends of each axis on the far and on the near side
};

}  // namespace

ViewTurn::ViewTurn(const SpaceTimeView& view) {
  constexpr double kRadians = std::numbers::pi / 180;
  sin_yaw = std::sin(view.yaw_deg * kRadians), cos_yaw = std::cos(view.yaw_deg * kRadians);
  sin_pitch = std::sin(view.pitch_deg * kRadians), cos_pitch = std::cos(view.pitch_deg * kRadians);
}

SpaceTimeView turned_view(double share) {
  return {kMiddleYaw_deg - kSwing_deg * std::cos(2 * std::numbers::pi * share), kPitch_deg};
}

SpaceTimeProjection::SpaceTimeProjection(const SpaceTimeBox& box, const SpaceTimeView& view, const Tile& area)
    : box_(box), turn_(view) {
  constexpr int kTurns = 8;
  const Point half = half_extent(box.sensor);
  double left = 0, right = 0, top = 0, bottom = 0;
  for (int turn = 0; turn <= kTurns; ++turn) {
    const ViewTurn other(turned_view(0.5 * turn / kTurns));
    for (int i = 0; i < 8; ++i) {
      const Seen seen = see(corner(half, i), other);
      left = std::min(left, seen.u);
      right = std::max(right, seen.u);
      top = std::min(top, seen.v);
      bottom = std::max(bottom, seen.v);
    }
  }
  const double width = std::max(area.width - 2 * kLabelSpace, 0.5 * area.width);
  const double height = std::max(area.height - 2 * kLabelSpace, 0.5 * area.height);
  scale_ = std::min(width / (right - left), height / (bottom - top));
  centre_ = {area.x + 0.5 * area.width - 0.5 * scale_ * (left + right),
             area.y + 0.5 * area.height - 0.5 * scale_ * (top + bottom)};
}

SpaceTimeProjection::Place SpaceTimeProjection::place(double x, double y, double t_ns) const {
  const double longer = std::max(box_.sensor.width, box_.sensor.height);
  const double share = (t_ns - static_cast<double>(box_.start)) / static_cast<double>(box_.end - box_.start);
  const Seen seen = see({(x + 0.5 - 0.5 * box_.sensor.width) / longer, (y + 0.5 - 0.5 * box_.sensor.height) / longer,
                         kTimeLength * (0.5 - share)},
                        turn_);
  return {{centre_.x + scale_ * seen.u, centre_.y + scale_ * seen.v},
          seen.distance,
          scale_ / longer * kViewerDistance / seen.distance};
}

Image<Rgb> draw_space_time(EventSpan events, const SpaceTimeBox& box, const SpaceTimeView& view, int width, int height,
                           const Theme& theme) {
  Plot plot(box, view, width, height, theme);
  plot.draw_back();
  plot.draw_points(events);
  plot.draw_labels();
  return std::move(plot).take();
}

}  // namespace esim::inline visualise

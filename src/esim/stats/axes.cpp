#include "esim/stats/axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace esim::inline stats {
namespace {

constexpr int kTitleHeight = 13, kTextHeight = 10;

// mantissa times 10^exponent with a prefix.
std::string decade_label(int mantissa, int exponent, bool seconds) {
  constexpr std::array<const char*, 7> kPrefixes = {"n", "u", "m", "", "k", "M", "G"};
  const int lowest = seconds ? -3 : 0, highest = seconds ? 0 : 3;  // not ks, and 0.1 instead of 100m
  const int group = std::clamp(static_cast<int>(std::floor(exponent / 3.0)), lowest, highest);
  const double factor = mantissa * std::pow(10.0, exponent - 3 * group);
  return fmt::format("{:g}{}{}{}", factor, seconds ? " " : "", kPrefixes[static_cast<std::size_t>(group + 3)],
                     seconds ? "s" : "");
}

}  // namespace

double Scale::position(double value) const {
  if (!logarithmic) return (value - low) / (high - low);
  return value > 0 ? std::log(value / low) / std::log(high / low) : -1.0;
}

Scale linear_scale(double low, double high, std::string title, bool absolute) {
  Scale scale{low, high, false, {}, std::move(title)};
  const double raw = (high - low) / 5;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double mantissa = raw / power;
  const double step = power * (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10);
  for (double index = std::ceil(low / step - 0.01); index * step <= high + 0.01 * step; ++index) {
    const double value = index == 0 ? 0.0 : index * step;
    scale.ticks.push_back({value, fmt::format("{:.6g}", absolute ? std::abs(value) : value)});
  }
  return scale;
}

Scale decade_scale(double low, double high, std::string title, bool seconds) {
  Scale scale{low, high, true, {}, std::move(title)};
  const int first = static_cast<int>(std::floor(std::log10(low))), last = static_cast<int>(std::ceil(std::log10(high)));
  const bool few = last - first <= 3;
  for (int exponent = first; exponent <= last; ++exponent) {
    for (const int mantissa : {1, 2, 5}) {
      const double value = mantissa * std::pow(10.0, exponent);
      const bool within = value > 0.999 * low && value < 1.001 * high;
      if (within && (mantissa == 1 || few)) scale.ticks.push_back({value, decade_label(mantissa, exponent, seconds)});
    }
  }
  return scale;
}

Axes::Axes(Canvas& canvas, const Tile& area, const std::string& title, Scale x, Scale y)
    : canvas_(canvas), area_(area), x_(std::move(x)), y_(std::move(y)) {
  canvas_.text(area_.x - 56, area_.y - 32, title, kTitleHeight, kInk);
  canvas_.text(area_.x - 56, area_.y - 11, y_.title, kTextHeight, kFaintInk);
  for (const Tick& tick : x_.ticks) canvas_.fill({column(tick.value), area_.y, 1, area_.height}, kGrid);
  for (const Tick& tick : y_.ticks) canvas_.fill({area_.x, row(tick.value), area_.width, 1}, kGrid);
}

Spot Axes::spot(const DataPoint& point) const {
  return {area_.x + std::clamp(x_.position(point.x), 0.0, 1.0) * (area_.width - 1),
          area_.y + (1 - std::clamp(y_.position(point.y), 0.0, 1.0)) * (area_.height - 1)};
}

int Axes::column(double x) const {
  const double position = std::clamp(x_.position(x), 0.0, 1.0);
  return area_.x + static_cast<int>(std::lround(position * (area_.width - 1)));
}

int Axes::row(double y) const {
  const double position = std::clamp(y_.position(y), 0.0, 1.0);
  return area_.y + static_cast<int>(std::lround((1 - position) * (area_.height - 1)));
}

void Axes::fill(double x0, double x1, double y0, double y1, Rgb colour) {
  const int left = column(x0), right = std::max(left + 1, column(x1));
  const int top = row(y1), bottom = row(y0);
  canvas_.fill({left, top, right - left, bottom - top}, colour);
}

void Axes::horizontal_line(double y, Rgb colour) { canvas_.fill({area_.x, row(y), area_.width, 1}, colour); }

void Axes::line(std::span<const DataPoint> points, Rgb colour, double width) {
  std::vector<Spot> spots;
  for (const DataPoint& point : points) spots.push_back(spot(point));
  canvas_.polyline(spots, width, colour);
}

void Axes::dot(const DataPoint& point, double radius, Rgb colour) { canvas_.disc(spot(point), radius, colour); }

void Axes::label(const DataPoint& point, const std::string& text, Rgb colour) {
  const Spot at = spot(point);
  canvas_.text(static_cast<int>(at.x) + 5, static_cast<int>(at.y) - 6, text, kTextHeight, colour);
}

void Axes::vertical_line(double x, const std::string& label, Rgb colour) {
  canvas_.fill({column(x), area_.y, 1, area_.height}, colour);
  canvas_.text(column(x) + 5, area_.y + 16, label, kTextHeight, colour);
}

void Axes::finish() {
  canvas_.outline({area_.x - 1, area_.y - 1, area_.width + 2, area_.height + 2}, kFaintInk);
  const int bottom = area_.y + area_.height;
  for (const Tick& tick : x_.ticks) {
    canvas_.fill({column(tick.value), bottom, 1, 5}, kFaintInk);
    canvas_.text(column(tick.value), bottom + 19, tick.label, kTextHeight, kInk, Align::centre);
  }
  for (const Tick& tick : y_.ticks) {
    canvas_.fill({area_.x - 5, row(tick.value), 5, 1}, kFaintInk);
    canvas_.text(area_.x - 9, row(tick.value) + kTextHeight / 2, tick.label, kTextHeight, kInk, Align::right);
  }
  canvas_.text(area_.x + area_.width / 2, bottom + 40, x_.title, kTextHeight, kFaintInk, Align::centre);
}

}  // namespace esim::inline stats

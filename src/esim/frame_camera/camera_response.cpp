#include "esim/frame_camera/camera_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline frame_camera {
namespace {

constexpr std::size_t kMaxPoints = 1 << 20;

/// Takes a number, and the blanks, comma or semicolon after it, from the front of `text`.
std::optional<double> take_number(std::string_view& text) {
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc{} || !std::isfinite(value)) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r,;"), text.size()));
  return value;
}

}  // namespace

CameraResponse::CameraResponse(const ResponseOptions& options) : options_(options) {
  const auto* const measured = std::get_if<MeasuredResponse>(&options);
  if (measured == nullptr) return;
  const std::string name = measured->path.string();
  if (name.empty()) throw UserError("frame_camera.response.path: is missing; give the file of the measured response");
  std::ifstream file = open_input(measured->path);
  if (!file) throw UserError(fmt::format("frame_camera.response.path: {}: cannot be read", name));

  std::vector<std::pair<double, double>> points;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const auto fail = [&](const std::string& what) { throw UserError(fmt::format("{}:{}: {}", name, number, what)); };
    std::string_view text = line;
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r"), text.size()));
    if (text.empty() || text.front() == '#') continue;
    const auto signal = take_number(text), level = signal ? take_number(text) : std::nullopt;
    if (!level || !text.empty()) {
      if (points.empty() && number == 1) continue;  // column names
      fail("a line of a measured response must hold two numbers, signal and level");
    }
    if (*signal < 0 || *level < 0) fail("signal and level must not be below 0");
    if (!points.empty() && *signal <= points.back().first)
      fail(fmt::format("the signal must rise from line to line, but {} is not greater than the previous {}", *signal,
                       points.back().first));
    if (!points.empty() && *level < points.back().second)
      fail(fmt::format("the level must not fall, but {} is below the previous {}; give a monotonic response", *level,
                       points.back().second));
    if (points.size() == kMaxPoints) fail("a measured response must have at most 2^20 lines");
    points.emplace_back(*signal, *level);
  }
  if (points.size() < 2 || points.back().second <= points.front().second)
    throw UserError(
        fmt::format("{}: a measured response must have at least two lines, with rising signal and level", name));
  const auto [full_signal, full_level] = points.back();
  for (const auto& [signal, level] : points)
    points_.push_back({static_cast<float>(signal / full_signal), static_cast<float>(level / full_level)});
}

void CameraResponse::apply(std::span<float> signal) const {
  if (const auto* const gamma = std::get_if<GammaResponse>(&options_)) {
    const auto exponent = static_cast<float>(1 / gamma->gamma);
    for (float& value : signal) value = value > 0 ? std::pow(value, exponent) : 0.0F;
  } else if (!points_.empty()) {
    for (float& value : signal) {
      const auto above = std::upper_bound(points_.begin(), points_.end(), value,
                                          [](float s, const Point& point) { return s < point.signal; });
      if (above == points_.begin()) {
        value = above->level;
      } else if (above == points_.end()) {
        value = points_.back().level;
      } else {
        const Point &a = *std::prev(above), &b = *above;
        value = a.level + (b.level - a.level) * ((value - a.signal) / (b.signal - a.signal));
      }
    }
  }
}

double CameraResponse::inverse(double level) const {
  if (const auto* const gamma = std::get_if<GammaResponse>(&options_)) return std::pow(level, gamma->gamma);
  if (points_.empty()) return level;
  const auto above = std::upper_bound(points_.begin(), points_.end(), level, [](double l, const Point& point) {
    return l < static_cast<double>(point.level);
  });
  if (above == points_.begin()) return static_cast<double>(above->signal);
  if (above == points_.end()) return 1;
  const Point &a = *std::prev(above), &b = *above;
  const double fraction = (level - static_cast<double>(a.level)) / static_cast<double>(b.level - a.level);
  return static_cast<double>(a.signal) + fraction * static_cast<double>(b.signal - a.signal);
}

}  // namespace esim::inline frame_camera

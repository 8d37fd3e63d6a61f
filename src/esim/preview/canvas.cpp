#include "esim/preview/canvas.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

namespace esim::inline preview {
namespace {

// Text is drawn larger by this factor, then reduced, so that it is smooth at any size.
constexpr int kOversampling = 4;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapitalHeight = 21.0;  // px, of the font at scale 1

double font_scale(int height) { return kOversampling * height / kCapitalHeight; }
int stroke(int height) { return std::max(1, static_cast<int>(std::lround(kOversampling * height * 0.115))); }

cv::Mat view(const Image<float>& image) {
  return {image.height(), image.width(), CV_32FC1, const_cast<float*>(image.data())};
}
cv::Mat view(const Image<Rgb>& image) {
  return {image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data())};
}

// OpenCV takes subpixel positions as fixed-point integers.
constexpr int kFractionBits = 4;
cv::Point fixed_point(const Spot& spot) {
  const auto fixed = [](double v) {
    return static_cast<int>(std::lround(std::clamp(v, -1e4, 1e5) * (1 << kFractionBits)));
  };
  return {fixed(spot.x), fixed(spot.y)};
}
cv::Scalar scalar(Rgb colour) { return {double(colour.r), double(colour.g), double(colour.b)}; }

constexpr int kTextBorder = 2;
int above_baseline(int height) { return height + height / 2; }

struct DrawnText {
  cv::Mat coverage;  // coverage of each pixel, with a margin for descenders and the stroke
  int width = 0;
};

DrawnText draw_text(const std::string& line, int height) {
  int base = 0;
  const cv::Size size = cv::getTextSize(line, kFont, font_scale(height), stroke(height), &base);
  const int width = (size.width + kOversampling - 1) / kOversampling;
  const int above = above_baseline(height), below = height / 2 + kTextBorder;
  cv::Mat large = cv::Mat::zeros((above + below) * kOversampling, (width + 2 * kTextBorder) * kOversampling, CV_8UC1);
  cv::putText(large, line, {kTextBorder * kOversampling, above * kOversampling}, kFont, font_scale(height),
              cv::Scalar(255), stroke(height), cv::LINE_AA);
  cv::Mat coverage;
  cv::resize(large, coverage, {width + 2 * kTextBorder, above + below}, 0, 0, cv::INTER_AREA);
  return {std::move(coverage), width};
}

/// Most lines of text are the same in many frames of a video, so each thread caches recent ones.
const DrawnText& drawn_text(std::string_view line, int height) {
  constexpr std::size_t kMax = 512;
  thread_local std::map<std::pair<std::string, int>, DrawnText> drawn;
  const std::pair key(std::string(line), height);
  const auto found = drawn.find(key);
  if (found != drawn.end()) return found->second;
  if (drawn.size() >= kMax) drawn.clear();
  return drawn.emplace(key, draw_text(key.first, height)).first->second;
}

/// The position of a pixel of an enlarged image along one side of the original: within one pixel, or partly in the
/// next.
struct Source {
  int first = 0, second = 0;
  std::uint16_t of_second = 0;  // weight of the second pixel, out of kWhole
};
constexpr std::uint16_t kWhole = 256;

std::vector<Source> sources(int from, int to) {
  std::vector<Source> all(static_cast<std::size_t>(to));
  const double step = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const int first = std::min(static_cast<int>(i * step), from - 1);
    const double beyond = ((i + 1) * step - (first + 1)) / step;
    const auto of_second = static_cast<std::uint16_t>(std::lround(kWhole * std::clamp(beyond, 0.0, 1.0)));
    all[static_cast<std::size_t>(i)] = {first, std::min(first + 1, from - 1), of_second};
  }
  return all;
}

std::uint8_t blend(std::uint8_t a, std::uint8_t b, std::uint16_t of_b) {
  return static_cast<std::uint8_t>(static_cast<std::uint16_t>(a * (kWhole - of_b) + b * of_b + kWhole / 2) >> 8);
}

void enlarge_row(const Rgb* row, const std::vector<Source>& columns, Rgb* out) {
  for (const auto& [first, second, of_second] : columns) {
    const Rgb a = row[first], b = row[second];
    *out++ =
        of_second == 0 ? a : Rgb{blend(a.r, b.r, of_second), blend(a.g, b.g, of_second), blend(a.b, b.b, of_second)};
  }
}

Tile intersect(const Tile& a, const Tile& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  return {x, y, std::max(0, std::min(a.x + a.width, b.x + b.width) - x),
          std::max(0, std::min(a.y + a.height, b.y + b.height) - y)};
}

}  // namespace

void Canvas::draw(const Image<Rgb>& image, int x, int y) {
  const Tile visible = intersect({x, y, image.width(), image.height()}, pixels_.bounds());
  for (int row = visible.y; row < visible.y + visible.height; ++row) {
    std::copy_n(image.row(row - y) + (visible.x - x), visible.width, pixels_.row(row) + visible.x);
  }
}

void Canvas::fill(const Tile& area, Rgb colour) {
  const Tile visible = intersect(area, pixels_.bounds());
  for (int row = visible.y; row < visible.y + visible.height; ++row) {
    std::fill_n(pixels_.row(row) + visible.x, visible.width, colour);
  }
}

void Canvas::outline(const Tile& area, Rgb colour) {
  fill({area.x, area.y, area.width, 1}, colour);
  fill({area.x, area.y + area.height - 1, area.width, 1}, colour);
  fill({area.x, area.y, 1, area.height}, colour);
  fill({area.x + area.width - 1, area.y, 1, area.height}, colour);
}

void Canvas::polyline(std::span<const Spot> points, double width, Rgb colour) {
  cv::Mat pixels = view(pixels_);
  for (std::size_t i = 1; i < points.size(); ++i) {
    cv::line(pixels, fixed_point(points[i - 1]), fixed_point(points[i]), scalar(colour),
             std::max(1, static_cast<int>(std::lround(width))), cv::LINE_AA, kFractionBits);
  }
}

void Canvas::disc(Spot centre, double radius, Rgb colour) {
  cv::Mat pixels = view(pixels_);
  cv::circle(pixels, fixed_point(centre), static_cast<int>(std::lround(radius * (1 << kFractionBits))), scalar(colour),
             cv::FILLED, cv::LINE_AA, kFractionBits);
}

int Canvas::text_width(std::string_view line, int height) { return drawn_text(line, height).width; }

int Canvas::text(int x, int baseline, std::string_view line, int height, Rgb colour, Align align) {
  const auto& [coverage, width] = drawn_text(line, height);
  if (align == Align::centre) x -= width / 2;
  if (align == Align::right) x -= width;
  const Tile box = {x - kTextBorder, baseline - above_baseline(height), coverage.cols, coverage.rows};
  const Tile visible = intersect(box, pixels_.bounds());
  for (int row = visible.y; row < visible.y + visible.height; ++row) {
    for (int column = visible.x; column < visible.x + visible.width; ++column) {
      const std::uint8_t covered = coverage.at<std::uint8_t>(row - box.y, column - box.x);
      if (covered == 0) continue;
      const float amount = static_cast<float>(covered) / 255.0f;
      pixels_(column, row) = mix(pixels_(column, row), colour, amount);
    }
  }
  return width;
}

Image<float> reduce_mean(const Image<float>& image, int width, int height) {
  Image<float> out(width, height);
  cv::Mat target = view(out);
  cv::resize(view(image), target, target.size(), 0, 0, cv::INTER_AREA);
  return out;
}

Image<float> reduce_nearest(const Image<float>& image, int width, int height) {
  Image<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    const float* row = image.row((2 * y + 1) * image.height() / (2 * height));
    for (int x = 0; x < width; ++x) out(x, y) = row[(2 * x + 1) * image.width() / (2 * width)];
  }
  return out;
}

std::string encode_png(const Image<Rgb>& image) {
  cv::Mat bgr;
  cv::cvtColor(view(image), bgr, cv::COLOR_RGB2BGR);
  std::vector<unsigned char> png;
  cv::imencode(".png", bgr, png, {cv::IMWRITE_PNG_COMPRESSION, 3});
  return {png.begin(), png.end()};
}

Image<Rgb> enlarge(const Image<Rgb>& image, int width, int height) {
  if (width == image.width() && height == image.height()) return image;
  Image<Rgb> out(width, height);
  if (width < image.width() || height < image.height()) {
    const int factor =
        std::max((width + image.width() - 1) / image.width(), (height + image.height() - 1) / image.height());
    cv::Mat repeated;
    cv::resize(view(image), repeated, {image.width() * factor, image.height() * factor}, 0, 0, cv::INTER_NEAREST);
    cv::Mat target = view(out);
    cv::resize(repeated, target, target.size(), 0, 0, cv::INTER_AREA);
    return out;
  }
  const std::vector<Source> columns = sources(image.width(), width), rows = sources(image.height(), height);
  Image<Rgb> above(width, 1), below(width, 1);  // two rows of the original, enlarged horizontally
  int in_above = -1, in_below = -1;
  for (int y = 0; y < height; ++y) {
    const auto& [first, second, of_second] = rows[static_cast<std::size_t>(y)];
    if (in_above != first && in_below == first) {
      std::swap(above, below);
      std::swap(in_above, in_below);
    }
    if (std::exchange(in_above, first) != first) enlarge_row(image.row(first), columns, above.data());
    if (of_second == 0) {
      std::copy_n(above.data(), width, out.row(y));
      continue;
    }
    if (std::exchange(in_below, second) != second) enlarge_row(image.row(second), columns, below.data());
    const auto* const a = reinterpret_cast<const std::uint8_t*>(above.data());
    const auto* const b = reinterpret_cast<const std::uint8_t*>(below.data());
    auto* const mixed = reinterpret_cast<std::uint8_t*>(out.row(y));
    for (int i = 0; i < 3 * width; ++i) mixed[i] = blend(a[i], b[i], of_second);
  }
  return out;
}

}  // namespace esim::inline preview

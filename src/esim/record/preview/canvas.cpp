#include "esim/record/preview/canvas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace esim {
namespace {

// Text is drawn this much larger, then reduced: smooth at any size.
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

// OpenCV takes places in fractions of a pixel as whole numbers.
constexpr int kFractionBits = 4;
cv::Point fixed_point(const Spot& spot) {
  const auto fixed = [](double v) {
    return static_cast<int>(std::lround(std::clamp(v, -1e4, 1e5) * (1 << kFractionBits)));
  };
  return {fixed(spot.x), fixed(spot.y)};
}
cv::Scalar scalar(Rgb colour) { return {double(colour.r), double(colour.g), double(colour.b)}; }

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

int Canvas::text_width(std::string_view line, int height) {
  int below = 0;
  const cv::Size size = cv::getTextSize(std::string(line), kFont, font_scale(height), stroke(height), &below);
  return (size.width + kOversampling - 1) / kOversampling;
}

int Canvas::text(int x, int baseline, std::string_view line, int height, Rgb colour, Align align) {
  const int width = text_width(line, height);
  if (align == Align::centre) x -= width / 2;
  if (align == Align::right) x -= width;

  // Coverage of each pixel, with room for what hangs below the baseline and for the stroke.
  const int border = 2, above = height + height / 2, below = height / 2 + border;
  cv::Mat large = cv::Mat::zeros((above + below) * kOversampling, (width + 2 * border) * kOversampling, CV_8UC1);
  cv::putText(large, std::string(line), {border * kOversampling, above * kOversampling}, kFont, font_scale(height),
              cv::Scalar(255), stroke(height), cv::LINE_AA);
  cv::Mat coverage;
  cv::resize(large, coverage, {width + 2 * border, above + below}, 0, 0, cv::INTER_AREA);

  const Tile box = {x - border, baseline - above, coverage.cols, coverage.rows};
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
  const int factor =
      std::max((width + image.width() - 1) / image.width(), (height + image.height() - 1) / image.height());
  cv::Mat repeated;
  cv::resize(view(image), repeated, {image.width() * factor, image.height() * factor}, 0, 0, cv::INTER_NEAREST);
  Image<Rgb> out(width, height);
  cv::Mat target = view(out);
  cv::resize(repeated, target, target.size(), 0, 0, cv::INTER_AREA);
  return out;
}

}  // namespace esim

#include "esim/record/formats/png_file.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "esim/record/output_file.h"

namespace esim {
namespace {

// Compressed fast: the gradients of simulated images shrink well with any effort.
void write(const std::filesystem::path& path, const cv::Mat& image) {
  std::vector<unsigned char> png;
  cv::imencode(".png", image, png, {cv::IMWRITE_PNG_COMPRESSION, 1});
  OutputFile file(path);
  file.append({reinterpret_cast<const char*>(png.data()), png.size()});
  file.flush();
}

template <typename T>
cv::Mat copy_of(const Image<T>& image, int type) {
  cv::Mat copy(image.height(), image.width(), type);
  std::copy_n(image.data(), image.size(), copy.ptr<T>());
  return copy;
}

cv::Mat demosaicked(const cv::Mat& mosaic) {
  // At the border OpenCV takes what is one pixel further in. Mirroring keeps each pixel's colour.
  constexpr int kBorder = 2;
  cv::Mat wide, colours;
  cv::copyMakeBorder(mosaic, wide, kBorder, kBorder, kBorder, kBorder, cv::BORDER_REFLECT_101);
  cv::cvtColor(wide, colours, cv::COLOR_BayerBG2BGR_EA);  // named after the second row, from its second column on
  return colours({kBorder, kBorder, mosaic.cols, mosaic.rows});
}

}  // namespace

void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image) {
  write(path, copy_of(image, CV_8UC1));
}

void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image) {
  write(path, copy_of(image, CV_16UC1));
}

void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint8_t>& mosaic) {
  write(path, demosaicked(copy_of(mosaic, CV_8UC1)));
}

void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint16_t>& mosaic) {
  write(path, demosaicked(copy_of(mosaic, CV_16UC1)));
}

}  // namespace esim

#include "esim/record/formats/png_file.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
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

}  // namespace

void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image) {
  write(path, copy_of(image, CV_8UC1));
}

void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image) {
  write(path, copy_of(image, CV_16UC1));
}

}  // namespace esim

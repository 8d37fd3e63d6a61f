#pragma once

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

namespace esim::test {

/// Writes an image of soft blobs, 128 px high.
inline void write_blobs(const std::filesystem::path& file, int width) {
  cv::Mat image(128, width, CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x)
      image.at<unsigned char>(y, x) = static_cast<unsigned char>(127 + 100 * std::sin(x * 0.3) * std::sin(y * 0.2));
  }
  cv::imwrite(file.string(), image);
}

}  // namespace esim::test

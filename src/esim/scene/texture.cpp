#include "esim/scene/texture.h"

#include <opencv2/imgproc.hpp>

namespace esim {

Texture::Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v) : wrap_u_(wrap_u), wrap_v_(wrap_v) {
  cv::Mat level(texels.height(), texels.width(), CV_32F, const_cast<float*>(texels.data()));
  while (true) {
    level_offset_[static_cast<unsigned>(levels_)] = static_cast<int>(texels_.size());
    level_width_[static_cast<unsigned>(levels_)] = level.cols;
    level_height_[static_cast<unsigned>(levels_)] = level.rows;
    texels_.insert(texels_.end(), level.ptr<float>(), level.ptr<float>() + level.total());
    ++levels_;
    if ((level.cols == 1 && level.rows == 1) || levels_ == kMaxLevels) break;

    // Each coarser texel is the exact mean over its area, also where the size is odd.
    cv::Mat coarser;
    cv::resize(level, coarser, {std::max(1, level.cols / 2), std::max(1, level.rows / 2)}, 0, 0, cv::INTER_AREA);
    level = coarser;
  }
}

}  // namespace esim

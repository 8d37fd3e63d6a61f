#pragma once

#include <filesystem>
#include <memory>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/recording/format.h"

// Private to fit.
namespace esim::inline fit {

/// The images of the first camera of a recording, as linear intensity in any unit: frames of a video, else the
/// irradiance of the ground truth, else those of a frame camera. Of these kinds, the one that comes first in the file.
class ImageStream {
 public:
  ImageStream(const std::filesystem::path& path, const ReadOptions& options);

  /// The next image; false at the end.
  bool next();
  TimeNs time() const { return time_; }
  const Image<float>& image() const { return image_; }  ///< 0: unknown, as in saturated pixels of a frame camera
  double progress() const { return source_->progress(); }

 private:
  bool take(const Record& record);

  std::unique_ptr<Source> source_;
  std::size_t kind_ = std::variant_npos;  // of Record
  TimeNs time_ = 0;
  Image<float> image_;
};

}  // namespace esim::inline fit

#include "esim/formats/images/images_png.h"

#include "esim/core/colour/srgb.h"
#include "esim/formats/images/png_file.h"

namespace esim::inline formats {

void ImagesPngWriter::begin(const RecordingInfo&) { files_.emplace(folder_, ".png"); }

void ImagesPngWriter::write(const Record& record) {
  if (const auto* image = std::get_if<ImageRecord>(&record)) {
    if (image->camera == camera_) write(image->t, image->irradiance);
  } else if (const auto* truth = std::get_if<TruthRecord>(&record)) {
    if (truth->camera == camera_) write(truth->t, truth->irradiance);
  }
}

void ImagesPngWriter::write(TimeNs t, const Image<float>& irradiance) {
  if (irradiance.empty() || last_ == t) return;
  last_ = t;
  write_png(files_->next_path(), encode_srgb(irradiance));
  files_->add(t);
}

void ImagesPngWriter::end(bool) {
  if (files_) files_->close();
  files_.reset();
}

}  // namespace esim::inline formats

#include "esim/formats/images/frames_png.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "esim/formats/images/png_file.h"

namespace esim::inline formats {

void FramesPngWriter::begin(const RecordingInfo&) {
  create_folder(folder_ / "frames");
  list_.emplace(folder_ / "frames.csv");
  list_->append("index,t_ns,exposure_ns,gain,exposure_start_ns,bits\n");
}

void FramesPngWriter::write(const Record& record) {
  const auto* frame = std::get_if<FrameRecord>(&record);
  if (frame == nullptr || frame->camera != camera_) return;

  const std::filesystem::path path = folder_ / "frames" / fmt::format("{:06}.png", count_);
  const auto write = [&](const auto& image) {
    in_colour_ ? write_demosaicked_png(path, image) : write_png(path, image);
  };
  if (frame->bits > 8) {
    write(frame->image);
  } else {
    Image<std::uint8_t> narrow(frame->image.width(), frame->image.height());
    std::transform(frame->image.pixels().begin(), frame->image.pixels().end(), narrow.pixels().begin(),
                   [](std::uint16_t number) { return static_cast<std::uint8_t>(number); });
    write(narrow);
  }
  fmt::format_to(std::back_inserter(list_->buffer()), "{},{},{},{},{},{}\n", count_, frame->t, frame->exposure_duration,
                 frame->gain, frame->exposure_start, frame->bits);
  list_->flush();
  ++count_;
}

void FramesPngWriter::end(bool) {
  if (list_) list_->close();
  list_.reset();
}

}  // namespace esim::inline formats

#include "esim/formats/images/image_sequences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"
#include "esim/formats/images/timed_files.h"
#include "esim/recording/record_stream.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

const Image<float>& image_in(const SequenceImages& images) {
  for (const Image<float>* image : {&images.depth, &images.field_x}) {
    if (!image->empty()) return *image;
  }
  return images.irradiance;
}

class SequenceStream final : public RecordStream {
 public:
  SequenceStream(FileSequence files, std::shared_ptr<SensorSize> size)
      : files_(std::move(files)), size_(std::move(size)) {
    ahead_ = files_.next(span_, file_);
  }

  /// Reads the first file to get the size of its images.
  void read_first() {
    if (ahead_ && !read_) read();
  }

  std::optional<TimeNs> due() override {
    if (!std::exchange(ahead_, false) && !files_.next(span_, file_)) return std::nullopt;
    return files_.optical_flows ? span_.end : span_.start;
  }

  const Record* next(TimeNs) override {
    if (!std::exchange(read_, false)) read();
    read_ = false;
    const auto& [irradiance, depth, field_x, field_y] = images_;
    if (!files_.optical_flows)
      return &record_.emplace(TruthRecord{0, span_.start, {}, irradiance, depth, field_x, field_y});
    known_ = Image<std::uint8_t>(field_x.width(), field_x.height());
    std::transform(field_x.pixels().begin(), field_x.pixels().end(), known_.pixels().begin(),
                   [](float x) { return static_cast<std::uint8_t>(std::isnan(x) ? 0 : 1); });
    return &record_.emplace(OpticalFlowRecord{0, span_.start, span_.end, field_x, field_y, known_});
  }

 private:
  void read() {
    files_.read(file_, images_);
    const Image<float>& image = image_in(images_);
    if (size_->width == 0) *size_ = {image.width(), image.height()};
    if (image.width() != size_->width || image.height() != size_->height) {
      throw UserError(fmt::format("cannot read {}: its image has {} x {} px, but the earlier images have {} x {} px",
                                  file_.string(), image.width(), image.height(), size_->width, size_->height));
    }
    read_ = true;
  }

  FileSequence files_;
  std::shared_ptr<SensorSize> size_;  // of all sequences
  TimeSpan span_{};
  fs::path file_;
  bool ahead_ = false;  // the current file has not been handed out yet
  bool read_ = false;   // its images have been read already
  SequenceImages images_;
  Image<std::uint8_t> known_;
  std::optional<Record> record_;
};

}  // namespace

void FrameFlow::add(const Record& record) {
  if (const auto* moved = std::get_if<OpticalFlowRecord>(&record); moved != nullptr && moved->camera == 0) {
    pending_.reset();
    write_({moved->t0, moved->t1}, moved->x, moved->y);
  }
  const auto* truth = std::get_if<TruthRecord>(&record);
  if (truth == nullptr || truth->camera != 0) return;
  flush();
  if (field_) {
    pending_ = std::move(field_);
    pending_->span.end = truth->t;
    const auto seconds = static_cast<float>(to_seconds(truth->t - pending_->span.start));
    for (Image<float>* image : {&pending_->x, &pending_->y}) {
      for (float& value : image->pixels()) value *= seconds;
    }
  }
  field_.reset();
  if (!truth->motion_x.empty()) field_ = Field{{truth->t, truth->t}, truth->motion_x, truth->motion_y};
}

void FrameFlow::finish() { flush(); }

void FrameFlow::flush() {
  if (pending_) write_(pending_->span, pending_->x, pending_->y);
  pending_.reset();
}

FileSequence listed_files(const fs::path& folder, bool optical_flows) {
  const auto list = std::make_shared<TimedFilesReader>(folder, optical_flows);
  const auto next = [list](TimeSpan& span, fs::path& file) {
    if (!list->next()) return false;
    span = list->span();
    file = list->file();
    return true;
  };
  return {next, {}, optical_flows};
}

std::unique_ptr<Source> open_sequences(std::vector<FileSequence> sequences, const ReadOptions& options) {
  RecordingInfo info;
  CameraInfo& camera = info.cameras.emplace_back();
  camera.name = "cam0";
  const auto size = std::make_shared<SensorSize>();
  std::vector<std::unique_ptr<RecordStream>> streams;
  for (FileSequence& files : sequences) {
    auto stream = std::make_unique<SequenceStream>(std::move(files), size);
    try {
      if (size->width == 0) stream->read_first();
    } catch (const UserError&) {  // it is thrown again when it is the turn of the file
    }
    streams.push_back(std::move(stream));
  }
  camera.model.width = size->width, camera.model.height = size->height;
  return merge_streams(std::move(info), std::move(streams), options);
}

}  // namespace esim::inline formats

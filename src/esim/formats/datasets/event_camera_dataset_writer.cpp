#include "esim/formats/datasets/event_camera_dataset_writer.h"

#include <fmt/format.h>

#include <iterator>
#include <optional>
#include <utility>

#include "esim/files/number_text.h"
#include "esim/formats/datasets/event_camera_dataset_files.h"
#include "esim/formats/images/png_file.h"

namespace esim::inline formats {
namespace {

std::optional<RadialTangential> coefficients(const Distortion& distortion) {
  if (std::holds_alternative<NoDistortion>(distortion)) return RadialTangential{};
  if (const auto* known = std::get_if<RadialTangential>(&distortion)) return *known;
  return std::nullopt;
}

class DatasetWriter final : public Sink {
 public:
  explicit DatasetWriter(std::function<std::unique_ptr<FilesOutput>()> open) : open_(std::move(open)) {}

  void begin(const RecordingInfo& info) override {
    files_ = open_();
    files_->append(kEventsTxt, "");
    if (info.cameras.empty()) return;
    const Camera& camera = info.cameras.front().model;
    const auto d = coefficients(camera.distortion);
    if (!d || camera.fx <= 0 || camera.fy <= 0) return;
    files_->append(kCalibTxt, fmt::format("{} {} {} {} {} {} {} {} {}\n", camera.fx, camera.fy, camera.cx, camera.cy,
                                          d->k1, d->k2, d->p1, d->p2, d->k3));
  }

  void write(const Record& record) override {
    if (const auto* events = std::get_if<EventsRecord>(&record); events && events->camera == 0) append(*events);
    if (const auto* frame = std::get_if<FrameRecord>(&record); frame && frame->camera == 0) append(*frame);
    if (const auto* imu = std::get_if<ImuRecord>(&record)) append(*imu);
    if (const auto* pose = std::get_if<PoseRecord>(&record)) append(*pose);
  }

  void end(bool) override {
    if (files_) files_->close();
    files_.reset();
  }

 private:
  void append(const EventsRecord& events) {
    for (const Event& event : events.events) {
      append_seconds(line_, event.t);
      fmt::format_to(std::back_inserter(line_), " {} {} {}\n", event.x, event.y, event.polarity > 0 ? 1 : 0);
      if (line_.size() > kFullBytes) finish(kEventsTxt);
    }
    finish(kEventsTxt);
  }

  void append(const FrameRecord& frame) {
    const std::string name = fmt::format("images/frame_{:08}.png", frames_++);
    files_->add(name, encode_png(frame.image, frame.bits));
    append_seconds(line_, frame.t);
    line_ += " " + name + "\n";
    finish(kImagesTxt);
  }

  void append(const ImuRecord& imu) {
    append_seconds(line_, imu.t);
    append(imu.measured.specific_force);
    append(imu.measured.angular_rate);
    line_ += '\n';
    finish(kImuTxt);
  }

  void append(const PoseRecord& pose) {
    const Eigen::Quaterniond& q = pose.body.T_world_body.rotation;
    append_seconds(line_, pose.t);
    append(pose.body.T_world_body.translation);
    fmt::format_to(std::back_inserter(line_), " {} {} {} {}\n", q.x(), q.y(), q.z(), q.w());
    finish(kGroundTruthTxt);
  }

  void append(const Eigen::Vector3d& value) {
    fmt::format_to(std::back_inserter(line_), " {} {} {}", value.x(), value.y(), value.z());
  }

  void finish(const char* name) {
    files_->append(name, line_);
    line_.clear();
  }

  static constexpr std::size_t kFullBytes = 1 << 16;

  std::function<std::unique_ptr<FilesOutput>()> open_;
  std::unique_ptr<FilesOutput> files_;
  std::string line_;
  std::int64_t frames_ = 0;
};

}  // namespace

std::unique_ptr<Sink> make_dataset_writer(std::function<std::unique_ptr<FilesOutput>()> open) {
  return std::make_unique<DatasetWriter>(std::move(open));
}

}  // namespace esim::inline formats

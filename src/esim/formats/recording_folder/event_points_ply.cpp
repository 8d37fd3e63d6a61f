#include "esim/formats/recording_folder/event_points_ply.h"

#include <fmt/format.h>

#include <bit>

namespace esim::inline formats {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written in the byte order of memory");

template <typename T>
void append_bytes(std::string& buffer, T number) {
  buffer.append(reinterpret_cast<const char*>(&number), sizeof number);
}

}  // namespace

/// Has the same length for every count, so that it can be replaced in place: a comment line is padded.
std::string EventPointsPlyWriter::header() const {
  constexpr std::size_t kDigits = 20;
  const std::string count = fmt::format("{}", count_);
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "comment esim: what the events of {} saw; x y z: world frame, m; t: s; u v: column and row, px\n"
      "comment {}\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\nproperty double t\n"
      "property ushort u\nproperty ushort v\nproperty char polarity\nend_header\n",
      name_, std::string(kDigits - count.size(), '-'), count);
}

void EventPointsPlyWriter::begin(const RecordingInfo& info) {
  name_ = info.cameras.at(static_cast<std::size_t>(camera_)).name;
  file_.emplace(path_);
  file_->append(header());
  file_->flush();
}

void EventPointsPlyWriter::write(const Record& record) {
  const auto* seen = std::get_if<EventPointsRecord>(&record);
  if (seen == nullptr || seen->camera != camera_) return;
  std::string& buffer = file_->buffer();
  for (std::size_t i = 0; i < seen->events.size(); ++i) {
    const Eigen::Vector3f& point = seen->points[i];
    if (!point.allFinite()) continue;
    const Event& event = seen->events[i];
    for (const float coordinate : {point.x(), point.y(), point.z()}) append_bytes(buffer, coordinate);
    append_bytes(buffer, to_seconds(event.t));
    append_bytes(buffer, event.x);
    append_bytes(buffer, event.y);
    append_bytes(buffer, event.polarity);
    ++count_;
  }
  file_->flush();
  file_->overwrite_start(header());
}

void EventPointsPlyWriter::end(bool) {
  if (file_) file_->close();
  file_.reset();
}

}  // namespace esim::inline formats

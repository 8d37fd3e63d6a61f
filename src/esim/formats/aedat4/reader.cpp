#include "esim/formats/aedat4/reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <optional>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "esim/formats/aedat4/buffers.h"
#include "esim/formats/aedat4/packets.h"

namespace esim::inline formats::aedat4 {
namespace {

constexpr flatbuffers::uoffset_t kPortion = 1 << 16;  // events
constexpr std::int64_t kLatestUs = std::numeric_limits<TimeNs>::max() / 2 / kNsPerUs;

bool is_plain(std::string_view name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), plain);
}

/// The luma (ITU-R BT.601) of a grey, BGR or BGRA pixel.
std::uint16_t luma(const std::uint16_t* numbers, int channels) {
  if (channels == 1) return numbers[0];
  return static_cast<std::uint16_t>((114U * numbers[0] + 587U * numbers[1] + 299U * numbers[2] + 500U) / 1000U);
}

/// Converts pixels of `channels` numbers of one or two bytes.
void decode_pixels(const std::uint8_t* bytes, int number_bytes, int channels, std::span<std::uint16_t> pixels) {
  for (std::uint16_t& pixel : pixels) {
    std::uint16_t numbers[4];
    for (int c = 0; c < channels; ++c, bytes += number_bytes) {
      numbers[c] = static_cast<std::uint16_t>(number_bytes == 1 ? bytes[0] : bytes[0] | (bytes[1] << 8));
    }
    pixel = luma(numbers, channels);
  }
}

/// The streams of one camera; -1: none.
struct CameraStreams {
  std::string source{};
  int events = -1, frames = -1, triggers = -1;
};

class Reader final : public Source {
 public:
  Reader(const std::filesystem::path& path, const ReadOptions& options);

  const RecordingInfo& info() const override { return info_; }
  std::vector<std::string> not_read() const override;
  double progress() const override { return packets_.progress(); }
  const Record* next() override;

 private:
  void find_cameras(const std::optional<SensorSize>& sensor);
  void name_cameras();
  bool read();
  void open(const Packet& packet);
  void take_events();
  void take_measurement();
  void take_trigger();
  void take_frame(const fb::Frame& frame, int camera);
  TimeNs time(std::int64_t us) const;
  [[noreturn]] void fail(std::string_view reason) const { packets_.fail(packet_, reason); }

  PacketReader packets_;
  RecordingInfo info_;
  std::vector<CameraStreams> cameras_;
  std::vector<int> wanted_;  // streams

  // The rest of the current packet.
  Packet packet_;
  int camera_ = 0;
  const flatbuffers::Vector<const fb::Event*>* elements_ = nullptr;
  const flatbuffers::Vector<flatbuffers::Offset<fb::Imu>>* measurements_ = nullptr;
  const flatbuffers::Vector<flatbuffers::Offset<fb::Trigger>>* triggers_ = nullptr;
  flatbuffers::uoffset_t taken_ = 0;

  std::vector<Event> events_;
  Image<std::uint16_t> image_;
  std::optional<Record> record_;
  bool waiting_ = false;  // the first record has been read but not handed out
  bool ended_ = false;
  std::exception_ptr damage_;
};

Reader::Reader(const std::filesystem::path& path, const ReadOptions& options) : packets_(path) {
  find_cameras(options.sensor);
  if (wanted_.empty()) {
    const std::vector<std::string> others = not_read();
    throw UserError(fmt::format(
        "cannot read {}: {}; supported stream types: EVTS, FRME, IMUS", path.string(),
        others.empty() ? "it has no streams" : "none of its streams has a supported type: " + list_of_some(others)));
  }
  name_cameras();
  // The first record determines the start.
  try {
    waiting_ = read();
  } catch (const UserError&) {
    damage_ = std::current_exception();
  }
  info_.start_known = false;
  if (!waiting_) return;
  const auto time_of = [](const auto& record) {
    if constexpr (std::is_same_v<std::decay_t<decltype(record)>, EventsRecord>) return record.events.front().t;
    if constexpr (requires { record.t; }) return record.t;
    return TimeNs{0};
  };
  info_.start = info_.end = std::visit(time_of, *record_);
  const auto times = packets_.times();
  if (times && times->start_us >= -kLatestUs && times->end_us <= kLatestUs) {
    info_.start = std::min(info_.start, times->start_us * kNsPerUs);
    info_.end = std::max(info_.end, times->end_us * kNsPerUs);
  }
}

std::vector<std::string> Reader::not_read() const {
  std::vector<std::string> others;
  for (const Stream& stream : packets_.streams()) {
    const bool known = stream.type == "EVTS" || stream.type == "FRME" || stream.type == "IMUS" || stream.type == "TRIG";
    if (!known) others.push_back(fmt::format("{} of {}", stream.type, stream.source));
  }
  return others;
}

/// A camera is a source with at most one stream of events and one of frames: a second stream of a kind belongs to
/// another camera.
void Reader::find_cameras(const std::optional<SensorSize>& sensor) {
  for (const Stream& stream : packets_.streams()) {
    const bool events = stream.type == "EVTS", frames = stream.type == "FRME";
    if (stream.type == "IMUS" && !info_.imu) {  // the first of several
      info_.imu.emplace();
      wanted_.push_back(stream.id);
    }
    if (!events && !frames) continue;
    const auto member = events ? &CameraStreams::events : &CameraStreams::frames;
    const auto lacks = [&](const CameraStreams& camera) {
      return camera.source == stream.source && camera.*member < 0;
    };
    auto camera = std::find_if(cameras_.begin(), cameras_.end(), lacks);
    if (camera == cameras_.end()) {
      camera = cameras_.insert(cameras_.end(), {stream.source});
      info_.cameras.emplace_back();
    }
    (*camera).*member = stream.id;
    wanted_.push_back(stream.id);
    CameraInfo& info = info_.cameras[static_cast<std::size_t>(camera - cameras_.begin())];
    info.has_frames |= frames;
    Camera& model = info.model;
    const SensorSize size = sensor.value_or(SensorSize{stream.width, stream.height});
    // Frames may differ in size from the events' sensor.
    if (events || model.width == 0) model.width = size.width, model.height = size.height;
  }
  for (const Stream& stream : packets_.streams()) {
    const auto of_stream = [&](const CameraStreams& camera) { return camera.source == stream.source; };
    const auto camera = std::find_if(cameras_.begin(), cameras_.end(), of_stream);
    if (stream.type != "TRIG" || camera == cameras_.end() || camera->triggers >= 0) continue;
    camera->triggers = stream.id;
    wanted_.push_back(stream.id);
  }
  if (info_.cameras.empty()) info_.cameras.emplace_back();
}

/// Names cameras as in the file if this gives each a unique, plain name.
void Reader::name_cameras() {
  std::vector<std::string> names;
  for (const CameraStreams& camera : cameras_) names.push_back(camera.source);
  std::sort(names.begin(), names.end());
  const bool unique = std::adjacent_find(names.begin(), names.end()) == names.end();
  const bool named = unique && !names.empty() && std::all_of(names.begin(), names.end(), is_plain);
  for (std::size_t i = 0; i < info_.cameras.size(); ++i) {
    info_.cameras[i].name = named ? cameras_[i].source : fmt::format("cam{}", i);
  }
}

const Record* Reader::next() {
  if (std::exchange(waiting_, false)) return &*record_;
  if (damage_) {
    ended_ = true;
    std::rethrow_exception(std::exchange(damage_, nullptr));
  }
  if (ended_) return nullptr;
  ended_ = true;  // also if the following throws
  ended_ = !read();
  return ended_ ? nullptr : &*record_;
}

/// Reads the next record into record_; returns false at the end.
bool Reader::read() {
  record_.reset();
  while (!record_) {
    if (elements_ != nullptr) {
      take_events();
    } else if (measurements_ != nullptr) {
      take_measurement();
    } else if (triggers_ != nullptr) {
      take_trigger();
    } else {
      const auto packet = packets_.next(wanted_);
      if (!packet) return false;
      open(*packet);
    }
  }
  return true;
}

void Reader::open(const Packet& packet) {
  packet_ = packet;
  taken_ = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    camera_ = static_cast<int>(i);
    if (cameras_[i].events == packet.stream) {
      const auto* events = verified<fb::EventPacket>(packet.plain, "EVTS");
      if (events == nullptr) fail("the event packet is damaged");
      elements_ = events->elements();
      return;
    }
    if (cameras_[i].frames == packet.stream) {
      const auto* frame = verified<fb::Frame>(packet.plain, "FRME");
      if (frame == nullptr) fail("the frame is damaged");
      take_frame(*frame, camera_);
      return;
    }
    if (cameras_[i].triggers == packet.stream) {
      const auto* triggers = verified<fb::TriggerPacket>(packet.plain, "TRIG");
      if (triggers == nullptr) fail("the trigger packet is damaged");
      triggers_ = triggers->elements();
      return;
    }
  }
  const auto* imu = verified<fb::ImuPacket>(packet.plain, "IMUS");
  if (imu == nullptr) fail("the IMU packet is damaged");
  measurements_ = imu->elements();
}

TimeNs Reader::time(std::int64_t us) const {
  if (us < -kLatestUs || us > kLatestUs) fail(fmt::format("the time {} us is out of range", us));
  return us * kNsPerUs;
}

void Reader::take_events() {
  events_.clear();
  const flatbuffers::uoffset_t end = std::min(elements_->size(), taken_ + kPortion);
  for (; taken_ < end; ++taken_) {
    const fb::Event& event = *elements_->Get(taken_);
    const bool sound = event.x() >= 0 && event.y() >= 0 && std::abs(event.timestamp() / 2) <= kLatestUs / 2;
    if (!sound && events_.empty()) {
      fail(fmt::format("the event at ({}, {}) and {} us is out of range", event.x(), event.y(), event.timestamp()));
    }
    if (!sound) break;
    events_.push_back({event.timestamp() * kNsPerUs, static_cast<std::uint16_t>(event.x()),
                       static_cast<std::uint16_t>(event.y()), static_cast<std::int8_t>(event.on() ? 1 : -1)});
  }
  if (taken_ == elements_->size()) elements_ = nullptr;
  if (!events_.empty()) record_.emplace(EventsRecord{camera_, events_});
}

void Reader::take_measurement() {
  if (taken_ == measurements_->size()) {
    measurements_ = nullptr;
    return;
  }
  const fb::Imu& imu = *measurements_->Get(taken_++);
  ImuRecord record{.t = time(imu.timestamp())};
  record.measured.specific_force =
      kStandardGravity * Eigen::Vector3d(imu.accelerometer_x(), imu.accelerometer_y(), imu.accelerometer_z());
  record.measured.angular_rate =
      Eigen::Vector3d(imu.gyroscope_x(), imu.gyroscope_y(), imu.gyroscope_z()) / kDegreesPerRadian;
  record_.emplace(record);
}

/// Skips triggers of frames and exposures if there are frames, which have their own exposures.
void Reader::take_trigger() {
  if (taken_ == triggers_->size()) {
    triggers_ = nullptr;
    return;
  }
  const fb::Trigger& trigger = *triggers_->Get(taken_++);
  const auto last = static_cast<std::int8_t>(TriggerKind::exposure_end);
  if (trigger.kind() < 0 || trigger.kind() > last) fail(fmt::format("unknown trigger kind: {}", trigger.kind()));
  const auto kind = static_cast<TriggerKind>(trigger.kind());
  const bool of_frames = kind >= TriggerKind::frame_start;
  if (of_frames && cameras_[static_cast<std::size_t>(camera_)].frames >= 0) return;
  record_.emplace(TriggerRecord{camera_, time(trigger.timestamp()), kind});
}

void Reader::take_frame(const fb::Frame& frame, int camera) {
  const int width = frame.size_x(), height = frame.size_y();
  const int depth = frame.format() & 7, channels = (frame.format() >> 3) + 1;
  const bool wide = depth == static_cast<int>(Depth::bits16);
  if ((!wide && depth != static_cast<int>(Depth::bits8)) || (channels != 1 && channels != 3 && channels != 4)) {
    fail(fmt::format("unsupported frame: OpenCV type {}, not grey, BGR or BGRA with 8 or 16 bits", frame.format()));
  }
  const std::size_t pixels =
      static_cast<std::size_t>(std::max(width, 0)) * static_cast<std::size_t>(std::max(height, 0));
  const int number_bytes = wide ? 2 : 1;
  const std::size_t bytes = frame.pixels() == nullptr ? 0 : frame.pixels()->size();
  if (pixels == 0 || bytes != pixels * static_cast<std::size_t>(channels * number_bytes)) {
    fail(fmt::format("damaged frame: {} x {} px in {} bytes", width, height, bytes));
  }
  if (image_.width() != width || image_.height() != height) image_ = Image<std::uint16_t>(width, height);
  decode_pixels(frame.pixels()->data(), number_bytes, channels, image_.pixels());

  // Programs define the frame's time differently, but the exposure clearly, where it is given.
  TimeNs start = time(frame.timestamp()), duration = std::max<TimeNs>(time(frame.exposure()), 0);
  const TimeNs opened = time(frame.timestamp_start_of_exposure()), closed = time(frame.timestamp_end_of_exposure());
  if (closed > opened) start = opened, duration = closed - opened;
  record_.emplace(FrameRecord{.camera = camera,
                              .t = start + duration / 2,
                              .exposure_start = start,
                              .exposure_duration = duration,
                              .image = image_,
                              .bits = wide ? 16 : 8});
}

}  // namespace

std::unique_ptr<Source> open_reader(const std::filesystem::path& path, const ReadOptions& options) {
  return std::make_unique<Reader>(path, options);
}

}  // namespace esim::inline formats::aedat4

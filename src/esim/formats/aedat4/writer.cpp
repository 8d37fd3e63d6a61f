#include "esim/formats/aedat4/writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/aedat4/buffers.h"
#include "esim/formats/aedat4/description.h"

namespace esim::inline formats::aedat4 {
namespace {

constexpr std::size_t kPacketEvents = 1 << 14;
constexpr std::size_t kPacketMeasurements = 1 << 10;
constexpr std::int64_t kPacketUs = 100'000;
constexpr int kMaxWritableExtent = 32768;  // px

std::int64_t to_us(TimeNs t) { return t / kNsPerUs - (t % kNsPerUs < 0 ? 1 : 0); }

template <typename Text>
std::string_view view(const Text& bytes) {
  return {reinterpret_cast<const char*>(bytes.GetBufferPointer()), bytes.GetSize()};
}

/// A row of the table of packets.
struct Entry {
  std::int64_t byte_offset = 0;
  fb::PacketHeader packet{};
  std::int64_t elements = 0, start_us = 0, end_us = 0;
};

class Writer final : public Sink {
 public:
  Writer(std::filesystem::path path, Packing packing) : path_(std::move(path)), packing_(packing), packer_(packing) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  int events_stream(std::size_t camera) const { return static_cast<int>(3 * camera); }
  int frames_stream(std::size_t camera) const { return static_cast<int>(3 * camera + 1); }
  int triggers_stream(std::size_t camera) const { return static_cast<int>(3 * camera + 2); }
  int imu_stream() const { return static_cast<int>(3 * events_.size()); }

  std::string header(std::int64_t data_table_position) const;
  void append(std::string_view bytes);
  void take(const EventsRecord& record);
  void take(const FrameRecord& frame);
  void take(const ImuRecord& imu);
  void take(const TriggerRecord& trigger);
  void flush_events(std::size_t camera);
  void flush_triggers(std::size_t camera);
  void flush_imu();
  template <typename Table>
  void write_packet(int stream, flatbuffers::Offset<Table> root, const char* identifier, Entry entry);
  void write_data_table();

  std::filesystem::path path_;
  Packing packing_;
  Packer packer_;
  std::optional<OutputFile> file_;
  std::int64_t position_ = 0;  // bytes so far
  std::string description_;
  std::vector<std::vector<fb::Event>> events_;  // of each camera, not written yet
  std::vector<ImuRecord> imu_;                  // likewise
  std::vector<std::vector<TriggerRecord>> triggers_;
  std::vector<Entry> table_;
  flatbuffers::FlatBufferBuilder builder_;
};

void Writer::begin(const RecordingInfo& info) {
  events_.assign(info.cameras.size(), {});
  triggers_.assign(info.cameras.size(), {});
  std::vector<Stream> streams;
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    const CameraInfo& camera = info.cameras[i];
    const int width = camera.model.width, height = camera.model.height;
    if (std::max(width, height) > kMaxWritableExtent) {
      throw UserError(fmt::format("{}: AEDAT 4 holds sensors of at most {} px per side, but {} has {} x {} px",
                                  path_.string(), kMaxWritableExtent, camera.name, width, height));
    }
    streams.push_back({events_stream(i), "EVTS", camera.name, width, height});
    streams.push_back({frames_stream(i), "FRME", camera.name, width, height});
    streams.push_back({triggers_stream(i), "TRIG", camera.name});
  }
  streams.push_back({imu_stream(), "IMUS", info.cameras.empty() ? "imu" : info.cameras.front().name});
  description_ = describe(streams, name_of(packing_));

  file_.emplace(path_);
  append(kVersionLine);
  append(header(-1));
}

/// Has the same length for every position.
std::string Writer::header(std::int64_t data_table_position) const {
  flatbuffers::FlatBufferBuilder builder;
  builder.ForceDefaults(true);
  const auto text = builder.CreateString(description_);
  const auto packing = static_cast<fb::CompressionType>(packing_);
  builder.FinishSizePrefixed(fb::CreateIOHeader(builder, packing, data_table_position, text), "IOHE");
  return std::string(view(builder));
}

void Writer::append(std::string_view bytes) {
  file_->append(bytes);
  position_ += static_cast<std::int64_t>(bytes.size());
}

void Writer::write(const Record& record) {
  if (const auto* events = std::get_if<EventsRecord>(&record)) take(*events);
  if (const auto* frame = std::get_if<FrameRecord>(&record)) take(*frame);
  if (const auto* imu = std::get_if<ImuRecord>(&record)) take(*imu);
  if (const auto* trigger = std::get_if<TriggerRecord>(&record)) take(*trigger);
}

void Writer::take(const EventsRecord& record) {
  const auto camera = static_cast<std::size_t>(record.camera);
  std::vector<fb::Event>& pending = events_.at(camera);
  for (const Event& event : record.events) {
    const std::int64_t t = to_us(event.t);
    const bool full = pending.size() == kPacketEvents;
    if (full || (!pending.empty() && t - pending.front().timestamp() > kPacketUs)) flush_events(camera);
    pending.emplace_back(t, static_cast<std::int16_t>(event.x), static_cast<std::int16_t>(event.y), event.polarity > 0);
  }
}

void Writer::flush_events(std::size_t camera) {
  std::vector<fb::Event>& pending = events_[camera];
  if (pending.empty()) return;
  const Entry entry{.elements = static_cast<std::int64_t>(pending.size()),
                    .start_us = pending.front().timestamp(),
                    .end_us = pending.back().timestamp()};
  const auto elements = builder_.CreateVectorOfStructs(pending);
  write_packet(events_stream(camera), fb::CreateEventPacket(builder_, elements), "EVTS", entry);
  pending.clear();
}

void Writer::take(const TriggerRecord& trigger) {
  const auto camera = static_cast<std::size_t>(trigger.camera);
  triggers_.at(camera).push_back(trigger);
  if (triggers_[camera].size() == kPacketMeasurements) flush_triggers(camera);
}

/// Writes in order of time: a frame arrives when its exposure ends, so what came in the meantime is written before it.
void Writer::flush_triggers(std::size_t camera) {
  std::vector<TriggerRecord>& pending = triggers_[camera];
  if (pending.empty()) return;
  std::ranges::stable_sort(pending, {}, &TriggerRecord::t);
  std::vector<flatbuffers::Offset<fb::Trigger>> elements;
  for (const TriggerRecord& trigger : pending)
    elements.push_back(fb::CreateTrigger(builder_, to_us(trigger.t), static_cast<std::int8_t>(trigger.kind)));
  const Entry entry{.elements = static_cast<std::int64_t>(pending.size()),
                    .start_us = to_us(pending.front().t),
                    .end_us = to_us(pending.back().t)};
  write_packet(triggers_stream(camera), fb::CreateTriggerPacket(builder_, builder_.CreateVector(elements)), "TRIG",
               entry);
  pending.clear();
}

/// The middle of the exposure is the start plus half the duration. With a rolling shutter, this is the middle of the
/// middle row.
void Writer::take(const FrameRecord& frame) {
  const std::int64_t start = to_us(frame.t - frame.exposure_duration / 2);
  const std::int64_t duration = to_us(frame.exposure_duration);
  const bool wide = frame.bits > 8;
  std::uint8_t* pixels = nullptr;
  const std::size_t count = frame.image.size();
  const auto stored = builder_.CreateUninitializedVector((wide ? 2 : 1) * count, &pixels);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t number = frame.image.pixels()[i];
    if (!wide) {
      pixels[i] = static_cast<std::uint8_t>(number);
    } else {
      pixels[2 * i] = static_cast<std::uint8_t>(number), pixels[2 * i + 1] = static_cast<std::uint8_t>(number >> 8);
    }
  }
  fb::FrameBuilder builder(builder_);
  builder.add_timestamp(start);
  builder.add_timestamp_start_of_exposure(start);
  builder.add_timestamp_end_of_exposure(start + duration);
  builder.add_exposure(duration);
  builder.add_pixels(stored);
  builder.add_size_x(static_cast<std::int16_t>(frame.image.width()));
  builder.add_size_y(static_cast<std::int16_t>(frame.image.height()));
  builder.add_format(static_cast<std::int8_t>(wide ? Depth::bits16 : Depth::bits8));
  const auto root = builder.Finish();
  write_packet(frames_stream(static_cast<std::size_t>(frame.camera)), root, "FRME",
               {.elements = 1, .start_us = start, .end_us = start});
  take(TriggerRecord{frame.camera, frame.exposure_start, TriggerKind::exposure_start});
  take(TriggerRecord{frame.camera, 2 * frame.t - frame.exposure_start, TriggerKind::exposure_end});
}

void Writer::take(const ImuRecord& imu) {
  if (imu_.size() == kPacketMeasurements || (!imu_.empty() && to_us(imu.t - imu_.front().t) > kPacketUs)) flush_imu();
  imu_.push_back(imu);
}

void Writer::flush_imu() {
  if (imu_.empty()) return;
  std::vector<flatbuffers::Offset<fb::Imu>> elements;
  for (const ImuRecord& imu : imu_) {
    const Eigen::Vector3f g = (imu.measured.specific_force / kStandardGravity).cast<float>();
    const Eigen::Vector3f degrees = (imu.measured.angular_rate * kDegreesPerRadian).cast<float>();
    elements.push_back(
        fb::CreateImu(builder_, to_us(imu.t), 0, g.x(), g.y(), g.z(), degrees.x(), degrees.y(), degrees.z()));
  }
  const Entry entry{.elements = static_cast<std::int64_t>(imu_.size()),
                    .start_us = to_us(imu_.front().t),
                    .end_us = to_us(imu_.back().t)};
  write_packet(imu_stream(), fb::CreateImuPacket(builder_, builder_.CreateVector(elements)), "IMUS", entry);
  imu_.clear();
}

/// The buffer that was built in builder_.
template <typename Table>
void Writer::write_packet(int stream, flatbuffers::Offset<Table> root, const char* identifier, Entry entry) {
  builder_.FinishSizePrefixed(root, identifier);
  const std::string_view packed = packer_.pack(view(builder_));
  entry.packet = fb::PacketHeader(stream, static_cast<std::int32_t>(packed.size()));
  append({reinterpret_cast<const char*>(&entry.packet), sizeof(entry.packet)});
  entry.byte_offset = position_;
  append(packed);
  table_.push_back(entry);
  builder_.Clear();
}

void Writer::write_data_table() {
  std::vector<flatbuffers::Offset<fb::PacketEntry>> entries;
  for (const Entry& entry : table_) {
    entries.push_back(fb::CreatePacketEntry(builder_, entry.byte_offset, &entry.packet, entry.elements, entry.start_us,
                                            entry.end_us));
  }
  builder_.FinishSizePrefixed(fb::CreateDataTable(builder_, builder_.CreateVector(entries)), "FTAB");
  append(packer_.pack(view(builder_)));
}

void Writer::end(bool) {
  if (!file_) return;
  for (std::size_t i = 0; i < events_.size(); ++i) flush_events(i), flush_triggers(i);
  flush_imu();
  const std::int64_t data_table_position = position_;
  write_data_table();
  file_->flush();
  file_->overwrite_start(kVersionLine + header(data_table_position));
  file_->close();
  file_.reset();
}

}  // namespace

std::unique_ptr<Sink> make_writer(std::filesystem::path path, Packing packing) {
  return std::make_unique<Writer>(std::move(path), packing);
}

}  // namespace esim::inline formats::aedat4

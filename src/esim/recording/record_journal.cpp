#include "esim/recording/record_journal.h"

#include <array>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/state_archive.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/files/input_file.h"

namespace esim::inline recording {
namespace {

// --- records as bytes ---------------------------------------------------------------------------------------

template <class Archive, class Vector>
void transfer_vector(Archive& archive, Vector& v) {
  for (int i = 0; i < v.size(); ++i) archive.value(v[i]);
}

template <class Archive, class Pose>
void transfer_pose(Archive& archive, Pose& pose) {
  transfer_vector(archive, pose.rotation.coeffs());
  transfer_vector(archive, pose.translation);
}

template <class Archive, class Motion>
void transfer_motion(Archive& archive, Motion& motion) {
  transfer_pose(archive, motion.T_world_body);
  for (auto* v : {&motion.velocity_world, &motion.acceleration_world, &motion.omega_body, &motion.alpha_body})
    transfer_vector(archive, *v);
}

template <class Archive, class Signals>
void transfer_signals(Archive& archive, Signals& signals) {
  transfer_vector(archive, signals.angular_rate);
  transfer_vector(archive, signals.specific_force);
}

void put(StateWriter& to, const EventsRecord& record) {
  to.value(record.camera);
  to.list(record.events);
  to.list(record.labels);
}
void pass(StateReader& from, Sink& out, const EventsRecord*) {
  int camera = 0;
  std::vector<Event> events;
  std::vector<EventLabel> labels;
  from.value(camera);
  from.list(events);
  from.list(labels);
  out.write(EventsRecord{camera, events, labels});
}

void put(StateWriter& to, const TruthRecord& record) {
  to.value(record.camera);
  to.value(record.t);
  transfer_pose(to, record.T_world_camera);
  for (const Image<float>* image : {&record.irradiance, &record.depth, &record.motion_x, &record.motion_y})
    to.sized_image(*image);
  to.value(record.object != nullptr);
  if (record.object != nullptr) to.sized_image(*record.object);
  to.objects(record.T_world_objects, [](auto& archive, const SE3& pose) { transfer_pose(archive, pose); });
}
void pass(StateReader& from, Sink& out, const TruthRecord*) {
  int camera = 0;
  TimeNs t = 0;
  SE3 pose;
  std::array<Image<float>, 4> images;
  bool has_object = false;
  Image<std::uint16_t> object;
  std::vector<SE3> T_world_objects;
  from.value(camera);
  from.value(t);
  transfer_pose(from, pose);
  for (Image<float>& image : images) from.sized_image(image);
  from.value(has_object);
  if (has_object) from.sized_image(object);
  from.objects(T_world_objects, [](auto& archive, SE3& one) { transfer_pose(archive, one); });
  out.write(TruthRecord{camera, t, pose, images[0], images[1], images[2], images[3], has_object ? &object : nullptr,
                        T_world_objects});
}

void put(StateWriter& to, const OpticalFlowRecord& record) {
  to.value(record.camera);
  to.value(record.t0);
  to.value(record.t1);
  to.sized_image(record.x);
  to.sized_image(record.y);
  to.sized_image(record.visible);
}
void pass(StateReader& from, Sink& out, const OpticalFlowRecord*) {
  int camera = 0;
  TimeNs t0 = 0, t1 = 0;
  Image<float> x, y;
  Image<std::uint8_t> visible;
  from.value(camera);
  from.value(t0);
  from.value(t1);
  from.sized_image(x);
  from.sized_image(y);
  from.sized_image(visible);
  out.write(OpticalFlowRecord{camera, t0, t1, x, y, visible});
}

void put(StateWriter& to, const EventPointsRecord& record) {
  to.value(record.camera);
  to.list(record.events);
  for (const Eigen::Vector3f& point : record.points) transfer_vector(to, point);
}
void pass(StateReader& from, Sink& out, const EventPointsRecord*) {
  int camera = 0;
  std::vector<Event> events;
  from.value(camera);
  from.list(events);
  std::vector<Eigen::Vector3f> points(events.size());
  for (Eigen::Vector3f& point : points) transfer_vector(from, point);
  out.write(EventPointsRecord{camera, events, points});
}

void put(StateWriter& to, const ImageRecord& record) {
  to.value(record.camera);
  to.value(record.t);
  to.sized_image(record.irradiance);
}
void pass(StateReader& from, Sink& out, const ImageRecord*) {
  int camera = 0;
  TimeNs t = 0;
  Image<float> irradiance;
  from.value(camera);
  from.value(t);
  from.sized_image(irradiance);
  out.write(ImageRecord{camera, t, irradiance});
}

void put(StateWriter& to, const FrameRecord& record) {
  to.value(record.camera);
  to.value(record.t);
  to.value(record.exposure_start);
  to.value(record.exposure_duration);
  to.value(record.gain);
  to.sized_image(record.image);
  to.value(record.bits);
}
void pass(StateReader& from, Sink& out, const FrameRecord*) {
  int camera = 0, bits = 0;
  TimeNs t = 0, start = 0, duration = 0;
  double gain = 0;
  Image<std::uint16_t> image;
  from.value(camera);
  from.value(t);
  from.value(start);
  from.value(duration);
  from.value(gain);
  from.sized_image(image);
  from.value(bits);
  out.write(FrameRecord{camera, t, start, duration, gain, image, bits});
}

void put(StateWriter& to, const PoseRecord& record) {
  to.value(record.t);
  transfer_motion(to, record.body);
  to.objects(record.objects, [](auto& archive, const Kinematics& motion) { transfer_motion(archive, motion); });
  to.value(record.imu_bias.has_value());
  if (record.imu_bias) transfer_signals(to, *record.imu_bias);
}
void pass(StateReader& from, Sink& out, const PoseRecord*) {
  PoseRecord record;
  bool has_bias = false;
  from.value(record.t);
  transfer_motion(from, record.body);
  from.objects(record.objects, [](auto& archive, Kinematics& motion) { transfer_motion(archive, motion); });
  from.value(has_bias);
  if (has_bias) transfer_signals(from, record.imu_bias.emplace());
  out.write(record);
}

void put(StateWriter& to, const ImuRecord& record) {
  to.value(record.t);
  transfer_signals(to, record.measured);
  transfer_signals(to, record.bias);
}
void pass(StateReader& from, Sink& out, const ImuRecord*) {
  ImuRecord record;
  from.value(record.t);
  transfer_signals(from, record.measured);
  transfer_signals(from, record.bias);
  out.write(record);
}

void put(StateWriter& to, const TriggerRecord& record) {
  to.value(record.camera);
  to.value(record.t);
  to.value(record.kind);
}
void pass(StateReader& from, Sink& out, const TriggerRecord*) {
  TriggerRecord record;
  from.value(record.camera);
  from.value(record.t);
  from.value(record.kind);
  out.write(record);
}

/// Passes the next record on, which is the `kind`-th alternative of Record.
template <std::size_t i = 0>
void pass_next(std::size_t kind, StateReader& from, Sink& out) {
  if constexpr (i < std::variant_size_v<Record>) {
    if (kind == i) return pass(from, out, static_cast<const std::variant_alternative_t<i, Record>*>(nullptr));
    pass_next<i + 1>(kind, from, out);
  } else {
    StateReader::fail();
  }
}

/// In front of each compressed block of records.
struct BlockHeader {
  std::uint64_t bytes = 0, compressed = 0;
};

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;  // at least
constexpr int kLevel = -10;

}  // namespace

// --- the file -----------------------------------------------------------------------------------------------

RecordJournal::RecordJournal(std::filesystem::path file, std::unique_ptr<Sink> out)
    : path_(std::move(file)), file_(std::in_place, path_), out_(std::move(out)) {}

RecordJournal::RecordJournal(std::filesystem::path file, std::uint64_t valid_bytes, std::unique_ptr<Sink> out)
    : path_(std::move(file)), to_replay_(valid_bytes), out_(std::move(out)) {
  std::error_code error;
  if (std::filesystem::file_size(path_, error) < valid_bytes || error) damaged();
}

void RecordJournal::damaged() const {
  throw UserError(path_.string() + " is damaged, and the simulation cannot be resumed; simulate it again");
}

/// Passes on the records of the first bytes of the file.
void RecordJournal::replay() {
  InputFile file(path_);
  const auto next = [&](std::uint64_t bytes) {
    if (bytes > to_replay_ - file.offset()) damaged();
    return file.read_exactly(bytes, "the records before the checkpoint");
  };
  while (file.offset() < to_replay_) {
    BlockHeader header;
    std::memcpy(&header, next(sizeof header).data(), sizeof header);
    const std::span<const std::byte> bytes = next(header.compressed);
    const std::string_view frame{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    if (zstandard_content_size(frame) != header.bytes) damaged();
    std::vector<std::byte> block(header.bytes);
    if (!decompress_zstandard(frame, {reinterpret_cast<char*>(block.data()), block.size()})) damaged();
    for (StateReader from(block); !from.at_end();) {
      std::uint8_t kind = 0;
      from.value(kind);
      pass_next(kind, from, *out_);
    }
  }
}

void RecordJournal::begin(const RecordingInfo& info) {
  out_->begin(info);
  if (file_) return;
  replay();
  file_.emplace(path_, to_replay_);
}

/// Appends the records to the file as one block.
void RecordJournal::write_block() {
  if (records_.empty()) return;
  compress_zstandard({reinterpret_cast<const char*>(records_.data()), records_.size()}, kLevel, frame_);
  const BlockHeader header{records_.size(), frame_.size()};
  file_->append({reinterpret_cast<const char*>(&header), sizeof header});
  file_->append(frame_);
  records_.clear();
}

void RecordJournal::write(const Record& record) {
  StateWriter to(records_);
  to.value(static_cast<std::uint8_t>(record.index()));
  std::visit([&](const auto& one) { put(to, one); }, record);
  if (records_.size() >= kBlockBytes) write_block();
  out_->write(record);
}

void RecordJournal::end(bool complete) { out_->end(complete); }

std::uint64_t RecordJournal::checkpoint() {
  write_block();
  file_->make_durable();
  return file_->size();
}

}  // namespace esim::inline recording

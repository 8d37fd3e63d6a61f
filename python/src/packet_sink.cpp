#include "packet_sink.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"

namespace esim::python {
namespace {

template <typename T>
void append(const Image<T>& image, std::vector<T>& out) {
  out.insert(out.end(), image.pixels().begin(), image.pixels().end());
}

}  // namespace

PacketSink::PacketSink(const PeriodicClock& clock) : clock_(clock) {}

void PacketSink::begin(const RecordingInfo& info) {
  end_ = info.end;
  cameras_ = info.cameras;
  open_.cameras.resize(info.cameras.size());
  if (clock_.due() == info.start) clock_.advance();
  open_packet(info.start);
}

void PacketSink::open_packet(TimeNs t0) {
  const std::size_t cameras = open_.cameras.size();
  open_ = Packet{};
  open_.cameras.resize(cameras);
  open_.t0 = t0;
  open_.t1 = std::min(clock_.due(), end_);
  if (clock_.due() <= open_.t1) clock_.advance();
}

void PacketSink::close_packet() {
  const TimeNs t1 = open_.t1;
  ready_.push_back(std::move(open_));
  open_.cameras.resize(ready_.back().cameras.size());
  open_packet(t1);
}

void PacketSink::advance_to(TimeNs t) {
  while (open_.t1 < t && open_.t1 < end_) close_packet();
}

void PacketSink::know(TimeNs t) {
  known_ = t;
  while (open_.t1 <= t && open_.t1 < end_) close_packet();
}

void PacketSink::end(bool complete) {
  if (!complete) open_.t1 = std::max(open_.t0, std::min(open_.t1, known_));
  ready_.push_back(std::move(open_));
}

Packet PacketSink::take() {
  Packet packet = std::move(ready_.front());
  ready_.pop_front();
  return packet;
}

void PacketSink::write(const Record& record) {
  std::visit([this](const auto& alternative) { write(alternative); }, record);
}

void PacketSink::write(const EventsRecord& record) {
  EventSpan rest = record.events;
  while (!rest.empty()) {
    advance_to(rest.front().t);
    const auto beyond = std::upper_bound(rest.begin(), rest.end(), open_.t1,
                                         [](TimeNs t1, const Event& event) { return t1 < event.t; });
    std::vector<Event>& events = part(record.camera).events;
    events.insert(events.end(), rest.begin(), beyond);
    rest = rest.subspan(static_cast<std::size_t>(beyond - rest.begin()));
  }
}

void PacketSink::write(const EventPointsRecord& record) {
  // They follow their events, which may have gone into several packets.
  std::size_t done = 0;
  const auto take = [&](Packet& packet) {
    CameraPart& camera = packet.cameras[static_cast<std::size_t>(record.camera)];
    while (camera.event_points.size() < 3 * camera.events.size() && done < record.points.size()) {
      const Eigen::Vector3f& point = record.points[done++];
      camera.event_points.insert(camera.event_points.end(), point.data(), point.data() + 3);
    }
  };
  for (Packet& packet : ready_) take(packet);
  take(open_);
}

template <typename T>
void PacketSink::require_size(const Image<T>& image, int camera, TimeNs t) const {
  const CameraInfo& info = cameras_[static_cast<std::size_t>(camera)];
  if (image.width() == info.model.width && image.height() == info.model.height) return;
  throw UserError(fmt::format("the image of {} at {} s has {} x {} px, and the camera {} x {}: give width and height",
                              info.name, to_seconds(t), image.width(), image.height(), info.model.width,
                              info.model.height));
}

void PacketSink::write(const TruthRecord& record) {
  for (const Image<float>* image : {&record.irradiance, &record.depth, &record.flow_x, &record.flow_y}) {
    if (!image->empty()) require_size(*image, record.camera, record.t);
  }
  advance_to(record.t);
  CameraPart& camera = part(record.camera);
  camera.t.push_back(record.t);
  append_matrix(record.T_world_camera, camera.poses);
  append(record.irradiance, camera.irradiance);
  append(record.depth, camera.depth);
  append(record.flow_x, camera.flow);
  append(record.flow_y, camera.flow);
  if (record.object != nullptr) append(*record.object, camera.object);
}

void PacketSink::write(const DisplacementRecord& record) {
  require_size(record.x, record.camera, record.t1);
  advance_to(record.t1);
  CameraPart& camera = part(record.camera);
  camera.displacement_span.insert(camera.displacement_span.end(), {record.t0, record.t1});
  append(record.x, camera.displacement);
  append(record.y, camera.displacement);
  append(record.visible, camera.visible);
}

void PacketSink::write(const FrameRecord& record) {
  require_size(record.image, record.camera, record.t);
  // The exposure's middle is rounded: a nanosecond is no reason to end a packet that the frame still belongs to.
  advance_to(2 * record.t - record.exposure_start - 1);
  CameraPart& camera = part(record.camera);
  camera.image_t.push_back(record.t);
  camera.exposure_start.push_back(record.exposure_start);
  camera.exposure.push_back(record.exposure_duration);
  camera.image_bits = record.bits;
  append(record.image, camera.images);
}

void PacketSink::write(const PoseRecord& record) {
  advance_to(record.t);
  open_.body.push_back(to_state(record.t, record.body));
  for (const Kinematics& object : record.objects) append_matrix(object.T_world_body, open_.objects);
}

void PacketSink::write(const ImuRecord& record) {
  advance_to(record.t);
  open_.imu.push_back(to_imu_sample(record.t, record.measured, record.bias));
}

void PacketSink::write(const TriggerRecord& record) {
  advance_to(record.t);
  part(record.camera).trigger_t.push_back(record.t);
  part(record.camera).trigger_kind.push_back(static_cast<std::uint8_t>(record.kind));
}

void PacketSink::write(const ImageRecord&) {}  // of videos only

}  // namespace esim::python

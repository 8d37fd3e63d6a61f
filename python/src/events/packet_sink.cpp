#include "events/packet_sink.h"

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
  known_ = reached_ = filled_ = info.start;
  cameras_ = info.cameras;
  if (clock_.due() == info.start) clock_.advance();
  begin_packet(info.start);
}

void PacketSink::begin_packet(TimeNs t0) {
  Packet& packet = packets_.emplace_back();
  packet.cameras.resize(cameras_.size());
  packet.t0 = t0;
  packet.t1 = std::min(clock_.due(), end_);
  if (clock_.due() <= packet.t1) clock_.advance();
}

/// Makes the packets until `t`.
void PacketSink::cover(TimeNs t) {
  while (covered() < t && covered() < end_) begin_packet(covered());
}

Packet& PacketSink::at(TimeNs t) {
  cover(t);
  filled_ = std::max(filled_, t);
  written_ = true;
  // It is almost always one of the last.
  auto packet = packets_.rbegin();
  while (t <= packet->t0 && packet + 1 != packets_.rend()) ++packet;
  return *packet;
}

void PacketSink::know(TimeNs t) {
  known_ = t;
  cover(t);
  if (covered() <= t && covered() < end_) begin_packet(covered());
}

void PacketSink::set_end(TimeNs t) {
  end_ = std::max(t, filled_);
  packets_.back().t1 = std::min(packets_.back().t1, end_);
}

void PacketSink::end(bool complete) {
  if (!complete) end_ = std::min(end_, std::max(known_, filled_));
  cover(end_);
  while (packets_.size() > 1 && packets_.back().t0 >= end_) packets_.pop_back();
  Packet& last = packets_.back();
  last.t1 = std::clamp(end_, last.t0, last.t1);
  if (last.t0 == last.t1 && (packets_.size() > 1 || !written_)) packets_.pop_back();
  ended_ = true;
}

Packet PacketSink::take() {
  Packet packet = std::move(packets_.front());
  packets_.pop_front();
  return packet;
}

void PacketSink::write(const Record& record) {
  std::visit([this](const auto& alternative) { write(alternative); }, record);
}

void PacketSink::write(const EventsRecord& record) {
  if (record.events.empty()) return;
  cover(record.events.back().t);
  for (EventsRecord rest = record; !rest.events.empty();) {
    Packet& packet = at(rest.events.front().t);
    const bool is_last = &packet == &packets_.back();
    const auto beyond = is_last ? rest.events.end() : std::ranges::upper_bound(rest.events, packet.t1, {}, &Event::t);
    const auto count = static_cast<std::size_t>(beyond - rest.events.begin());
    const EventsRecord taken = rest.part(0, count);
    CameraPart& camera = packet.cameras[static_cast<std::size_t>(record.camera)];
    camera.events.insert(camera.events.end(), taken.events.begin(), taken.events.end());
    camera.labels.insert(camera.labels.end(), taken.labels.begin(), taken.labels.end());
    rest = rest.part(count, rest.events.size() - count);
  }
  filled_ = std::max(filled_, record.events.back().t);
  reached_ = std::max(reached_, record.events.back().t);
}

void PacketSink::write(const EventPointsRecord& record) {
  // They follow their events, which may be in several packets.
  std::size_t done = 0;
  const auto take = [&](Packet& packet) {
    CameraPart& camera = packet.cameras[static_cast<std::size_t>(record.camera)];
    while (camera.event_points.size() < 3 * camera.events.size() && done < record.points.size()) {
      const Eigen::Vector3f& point = record.points[done++];
      camera.event_points.insert(camera.event_points.end(), point.data(), point.data() + 3);
    }
  };
  for (Packet& packet : packets_) take(packet);
}

template <typename T>
void PacketSink::require_size(const Image<T>& image, int camera, TimeNs t) const {
  const CameraInfo& info = cameras_[static_cast<std::size_t>(camera)];
  if (image.width() == info.model.width && image.height() == info.model.height) return;
  throw UserError(
      fmt::format("the image of {} at {} s has {} x {} px, but the camera {} x {} px; give width and height", info.name,
                  to_seconds(t), image.width(), image.height(), info.model.width, info.model.height));
}

void PacketSink::write(const TruthRecord& record) {
  for (const Image<float>* image : {&record.irradiance, &record.depth, &record.motion_x, &record.motion_y}) {
    if (!image->empty()) require_size(*image, record.camera, record.t);
  }
  reached_ = std::max(reached_, record.t);
  CameraPart& camera = part(record.camera, record.t);
  camera.t.push_back(record.t);
  append_matrix(record.T_world_camera, camera.poses);
  append(record.irradiance, camera.irradiance);
  append(record.depth, camera.depth);
  append(record.motion_x, camera.motion_field);
  append(record.motion_y, camera.motion_field);
  if (record.object != nullptr) append(*record.object, camera.object);
}

void PacketSink::write(const OpticalFlowRecord& record) {
  require_size(record.x, record.camera, record.t1);
  CameraPart& camera = part(record.camera, record.t1);
  camera.optical_flow_span.insert(camera.optical_flow_span.end(), {record.t0, record.t1});
  append(record.x, camera.optical_flow);
  append(record.y, camera.optical_flow);
  append(record.visible, camera.visible);
}

void PacketSink::write(const FrameRecord& record) {
  require_size(record.image, record.camera, record.t);
  reached_ = std::max(reached_, record.t);
  // A frame belongs to the packet in which its exposure ends. The middle of the exposure is rounded, so that the end
  // may be off by 1 ns.
  CameraPart& camera = part(record.camera, std::max(record.t, 2 * record.t - record.exposure_start - 1));
  camera.image_t.push_back(record.t);
  camera.exposure_start.push_back(record.exposure_start);
  camera.exposure.push_back(record.exposure_duration);
  camera.image_bits = record.bits;
  append(record.image, camera.images);
}

void PacketSink::write(const PoseRecord& record) {
  reached_ = std::max(reached_, record.t);
  Packet& packet = at(record.t);
  packet.body.push_back(to_state(record.t, record.body));
  for (const Kinematics& object : record.objects) append_matrix(object.T_world_body, packet.objects);
}

void PacketSink::write(const ImuRecord& record) {
  reached_ = std::max(reached_, record.t);
  at(record.t).imu.push_back(to_imu_sample(record.t, record.measured, record.bias));
}

void PacketSink::write(const TriggerRecord& record) {
  reached_ = std::max(reached_, record.t);
  CameraPart& camera = part(record.camera, record.t);
  camera.trigger_t.push_back(record.t);
  camera.trigger_kind.push_back(static_cast<std::uint8_t>(record.kind));
}

void PacketSink::write(const ImageRecord&) {}  // only from videos

}  // namespace esim::python

#include "esim/formats/ros/ros_sink.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "esim/core/colour/srgb.h"
#include "esim/core/error.h"
#include "esim/formats/ros/messages/event_array.h"
#include "esim/formats/ros/messages/sensor_messages.h"
#include "esim/formats/ros/topics.h"

namespace esim::inline formats::ros {
namespace {

// A message of events ends at whichever limit comes first.
constexpr TimeNs kEventsDuration = 10 * kNsPerMs;
constexpr std::size_t kEventsCount = 50'000;

// Of EventPackets, because of EVT 3.0: px; and the longest pause, in which each 4 ms take two bytes.
constexpr int kMaxPacketExtent = prophesee::evt3::kMaxExtent;
constexpr TimeNs kMaxPause = 4 * 3600 * kNsPerSecond;

std::array<double, 9> isotropic(double variance) { return {variance, 0, 0, 0, variance, 0, 0, 0, variance}; }

class RosSink final : public Sink {
 public:
  RosSink(std::filesystem::path path, Encoding encoding, std::optional<PacketEncoding> packets,
          std::function<std::unique_ptr<MessageOutput>()> create, bool at_once)
      : path_(std::move(path)), encoding_(encoding), packets_(packets), create_(std::move(create)), at_once_(at_once) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  void put(const EventsRecord& record);
  void put(const FrameRecord& record);
  void put(const ImageRecord& record);
  void put(const TruthRecord& record);
  void put_irradiance(int camera, TimeNs t, const Image<float>& irradiance);
  void put(const PoseRecord& record);
  void put(const ImuRecord& record);
  void put(const OpticalFlowRecord&) {}
  void put(const EventPointsRecord&) {}
  void put(const TriggerRecord&) {}

  template <typename T>
  void send(std::string_view topic, MessageType type, TimeNs t, const T& message);
  void flush_events(int camera);
  void send_events(int camera, EventSpan events);
  void send_camera_info(int camera, TimeNs t);
  void send_static_transforms();
  ImuMessage imu_message(TimeNs t, const InertialSignals& signals) const;
  std::string topic_of(int camera, std::string_view leaf) const { return camera_topic(camera_of(camera).name, leaf); }
  const CameraInfo& camera_of(int camera) const { return info_.cameras[static_cast<std::size_t>(camera)]; }
  Header header(TimeNs t, std::string_view frame) const { return {checked(t), ros_name(frame)}; }
  TransformMessage transform(TimeNs t, std::string_view frame, std::string_view child, const SE3& T_frame_child) const {
    return {header(t, frame), ros_name(child), T_frame_child};
  }
  TimeNs checked(TimeNs t) const;
  void require_fit(int width, int height) const;

  std::filesystem::path path_;
  Encoding encoding_;
  std::optional<PacketEncoding> packets_;
  std::function<std::unique_ptr<MessageOutput>()> create_;
  bool at_once_;
  std::unique_ptr<MessageOutput> output_;
  RecordingInfo info_;
  std::vector<std::vector<Event>> events_;    // of each camera, not yet written
  std::vector<EventPacketEncoder> encoders_;  // of each camera, if events are packets
  std::vector<TimeNs> last_packet_;           // time of the last event in a packet; 0: none yet
  std::string payload_;
  std::vector<std::uint8_t> pixels_;
};

TimeNs RosSink::checked(TimeNs t) const {
  const TimeNs max = encoding_ == Encoding::cdr ? std::numeric_limits<std::int32_t>::max()
                                                : std::numeric_limits<std::uint32_t>::max();  // s
  if (t >= 0 && t / kNsPerSecond <= max) return t;
  throw UserError(fmt::format("cannot write {}: the time {} s does not fit: ROS holds times from 0 to {} s",
                              path_.string(), to_seconds(t), max));
}

void RosSink::require_fit(int width, int height) const {
  if (!packets_ || (width <= kMaxPacketExtent && height <= kMaxPacketExtent)) return;
  throw UserError(
      fmt::format("cannot write {}: a sensor of {} x {} px does not fit: EventPackets hold at most {} x {} px",
                  path_.string(), width, height, kMaxPacketExtent, kMaxPacketExtent));
}

template <typename T>
void RosSink::send(std::string_view topic, MessageType type, TimeNs t, const T& message) {
  MessageWriter(encoding_, payload_)(message);
  output_->write(std::string(topic), type, t, payload_);
}

void RosSink::begin(const RecordingInfo& info) {
  info_ = info;
  events_.resize(info.cameras.size());
  if (packets_) encoders_.assign(info.cameras.size(), EventPacketEncoder(*packets_));
  last_packet_.assign(info.cameras.size(), 0);
  checked(info.start);
  for (const CameraInfo& camera : info.cameras) require_fit(camera.model.width, camera.model.height);
  output_ = create_();
  for (std::size_t i = 0; i < info.cameras.size(); ++i) send_camera_info(static_cast<int>(i), info.start);
  send_static_transforms();
}

void RosSink::send_camera_info(int camera, TimeNs t) {
  CameraInfoMessage message = to_message(camera_of(camera).model);
  message.header = header(t, camera_of(camera).name);
  send(topic_of(camera, topic::kCameraInfo), MessageType::camera_info, t, message);
}

void RosSink::send_static_transforms() {
  const TimeNs t = info_.start;
  TransformsMessage message;
  for (const CameraInfo& camera : info_.cameras) {
    message.transforms.push_back(transform(t, frame::kBody, camera.name, camera.T_body_camera));
  }
  if (info_.imu) message.transforms.push_back(transform(t, frame::kBody, frame::kImu, info_.imu->T_body_imu));
  send(topic::kStaticTransforms, MessageType::transforms, t, message);
}

void RosSink::write(const Record& record) {
  std::visit([this](const auto& kind) { put(kind); }, record);
}

void RosSink::put(const EventsRecord& record) {
  if (record.events.empty()) return;
  checked(record.events.front().t);
  checked(record.events.back().t);
  if (packets_) {
    int width = 0, height = 0;
    for (const Event& event : record.events)
      width = std::max<int>(width, event.x + 1), height = std::max<int>(height, event.y + 1);
    require_fit(width, height);
  }
  std::vector<Event>& waiting = events_[static_cast<std::size_t>(record.camera)];
  for (EventSpan rest = record.events; !rest.empty();) {
    const TimeNs end = (waiting.empty() ? rest.front().t : waiting.front().t) + kEventsDuration;
    const auto late = std::partition_point(rest.begin(), rest.end(), [&](const Event& event) { return event.t < end; });
    const std::size_t count = std::min(static_cast<std::size_t>(late - rest.begin()), kEventsCount - waiting.size());
    const EventSpan next = rest.first(count);
    rest = rest.subspan(count);
    const bool ends = !rest.empty() || waiting.size() + count == kEventsCount || at_once_;
    if (ends && waiting.empty()) {
      send_events(record.camera, next);
      continue;
    }
    waiting.insert(waiting.end(), next.begin(), next.end());
    if (ends) flush_events(record.camera);
  }
}

void RosSink::flush_events(int camera) {
  std::vector<Event>& waiting = events_[static_cast<std::size_t>(camera)];
  if (!waiting.empty()) send_events(camera, waiting);
  waiting.clear();
}

void RosSink::send_events(int camera, EventSpan events) {
  const TimeNs t = events.back().t;
  const Camera& model = camera_of(camera).model;
  const auto height = static_cast<std::uint32_t>(model.height), width = static_cast<std::uint32_t>(model.width);
  if (packets_) {
    TimeNs& last = last_packet_[static_cast<std::size_t>(camera)];
    if (packets_ == PacketEncoding::evt3 && last > 0 && events.front().t - last > kMaxPause) {
      throw UserError(fmt::format(
          "cannot write {}: a pause of {:.0f} s between events: packets with times in us hold at most {:.0f} s; write "
          "times in ns",
          path_.string(), to_seconds(events.front().t - last), to_seconds(kMaxPause)));
    }
    last = t;
    EventPacketMessage packet{.header = header(t, camera_of(camera).name), .height = height, .width = width};
    encoders_[static_cast<std::size_t>(camera)].encode(events, packet);
    send(topic_of(camera, topic::kEvents), MessageType::event_packet, t, packet);
  } else {
    MessageWriter writer(encoding_, payload_);
    writer(EventArrayHead{header(t, camera_of(camera).name), height, width});
    write_events(writer, events);
    output_->write(topic_of(camera, topic::kEvents), MessageType::events, t, payload_);
  }
}

void RosSink::put(const FrameRecord& record) {
  const int camera = record.camera;
  ImageMessage message = to_message(record.image, record.bits, pixels_);
  message.header = header(record.t, camera_of(camera).name);
  const FrameInfoMessage info{message.header, record.exposure_start, record.exposure_duration, record.gain,
                              static_cast<std::uint8_t>(record.bits)};
  send(topic_of(camera, topic::kFrameInfo), MessageType::frame_info, record.t, info);
  send_camera_info(camera, record.t);
  send(topic_of(camera, topic::kFrame), MessageType::image, record.t, message);
}

void RosSink::put(const ImageRecord& record) { put_irradiance(record.camera, record.t, record.irradiance); }

/// Also writes a grey image of the irradiance if there are no frames, since programs look for image_raw. Our reader
/// recognises it by the missing frame_info.
void RosSink::put_irradiance(int camera, TimeNs t, const Image<float>& irradiance) {
  if (irradiance.empty()) return;
  const Header of_camera = header(t, camera_of(camera).name);
  ImageMessage message = to_message(irradiance);
  message.header = of_camera;
  send(topic_of(camera, topic::kIrradiance), MessageType::image, t, message);
  if (camera_of(camera).has_frames) return;
  const Image<std::uint8_t> levels = encode_srgb(irradiance);
  ImageMessage picture = to_message(levels);
  picture.header = of_camera;
  send_camera_info(camera, t);
  send(topic_of(camera, topic::kFrame), MessageType::image, t, picture);
}

void RosSink::put(const TruthRecord& record) {
  const int camera = record.camera;
  const Header of_camera = header(record.t, camera_of(camera).name);
  put_irradiance(camera, record.t, record.irradiance);
  if (!record.depth.empty()) {
    ImageMessage depth = to_message(record.depth);
    depth.header = of_camera;
    send(topic_of(camera, topic::kDepth), MessageType::image, record.t, depth);
  }
  if (!record.motion_x.empty()) {
    FlowMessage flow = to_message(record.motion_x, record.motion_y);
    flow.header = of_camera;
    send(topic_of(camera, topic::kFlow), MessageType::flow, record.t, flow);
  }
  send(topic_of(camera, topic::kTruthPose), MessageType::pose, record.t,
       PoseMessage{header(record.t, frame::kWorld), record.T_world_camera});
}

void RosSink::put(const PoseRecord& record) {
  const TimeNs t = record.t;
  const auto twist = [&](const Kinematics& moving, std::string_view name) {
    const Eigen::Quaterniond R_body_world = moving.T_world_body.rotation.conjugate();
    return TwistMessage{header(t, name), R_body_world * moving.velocity_world, moving.omega_body};
  };
  for (int i = 0; i < static_cast<int>(info_.cameras.size()); ++i) {
    const Kinematics camera = rigidly_attached(record.body, camera_of(i).T_body_camera);
    send(topic_of(i, topic::kPose), MessageType::pose, t, PoseMessage{header(t, frame::kWorld), camera.T_world_body});
    send(topic_of(i, topic::kTwist), MessageType::twist, t, twist(camera, camera_of(i).name));
  }
  const Eigen::Quaterniond R_body_world = record.body.T_world_body.rotation.conjugate();
  send(topic::kBodyTwist, MessageType::twist, t, twist(record.body, frame::kBody));
  send(topic::kBodyAccel, MessageType::accel, t,
       TwistMessage{header(t, frame::kBody), R_body_world * record.body.acceleration_world, record.body.alpha_body});

  // Written last, because readers take the motion of a pose from the preceding messages.
  TransformsMessage transforms;
  transforms.transforms.push_back(transform(t, frame::kWorld, frame::kBody, record.body.T_world_body));
  for (std::size_t i = 0; i < std::min(record.objects.size(), info_.objects.size()); ++i) {
    transforms.transforms.push_back(transform(t, frame::kWorld, info_.objects[i], record.objects[i].T_world_body));
  }
  send(topic::kTransforms, MessageType::transforms, t, transforms);
}

ImuMessage RosSink::imu_message(TimeNs t, const InertialSignals& signals) const {
  ImuMessage message;
  message.header = header(t, frame::kImu);
  message.angular_velocity = signals.angular_rate;
  message.linear_acceleration = signals.specific_force;
  return message;
}

void RosSink::put(const ImuRecord& record) {
  send(topic::kImuBias, MessageType::imu, record.t, imu_message(record.t, record.bias));
  ImuMessage message = imu_message(record.t, record.measured);
  if (info_.imu) {
    const auto variance = [&](double density) { return density * density * info_.imu->rate_hz; };
    message.angular_velocity_covariance = isotropic(variance(info_.imu->gyroscope_noise_density));
    message.linear_acceleration_covariance = isotropic(variance(info_.imu->accelerometer_noise_density));
  }
  send(topic::kImu, MessageType::imu, record.t, message);
}

void RosSink::end(bool) {
  if (!output_) return;
  for (int i = 0; i < static_cast<int>(events_.size()); ++i) flush_events(i);
  output_->close();
  output_.reset();
}

}  // namespace

std::unique_ptr<Sink> make_sink(std::filesystem::path path, Encoding encoding, std::optional<PacketEncoding> packets,
                                std::function<std::unique_ptr<MessageOutput>()> create, bool at_once) {
  return std::make_unique<RosSink>(std::move(path), encoding, packets, std::move(create), at_once);
}

Format with_packets(Format format, std::string name, std::string description,
                    std::unique_ptr<Sink> (*make)(const std::filesystem::path& path, const WriteOptions& options,
                                                  std::optional<PacketEncoding> packets)) {
  format.name = std::move(name);
  format.description = std::move(description);
  format.either_unit = true;
  format.max_width = format.max_height = kMaxPacketExtent;
  format.recognises = {};
  format.create = [make](const auto& path, const WriteOptions& options) {
    return make(path, options, options.unit == TimeUnit::ns ? PacketEncoding::mono : PacketEncoding::evt3);
  };
  return format;
}

}  // namespace esim::inline formats::ros

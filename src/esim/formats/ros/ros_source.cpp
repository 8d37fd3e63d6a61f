#include "esim/formats/ros/ros_source.h"

#include <algorithm>
#include <exception>
#include <set>
#include <string>
#include <utility>

#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "esim/formats/ros/messages/event_array.h"
#include "esim/formats/ros/messages/event_packet.h"
#include "esim/formats/ros/messages/sensor_messages.h"
#include "esim/formats/ros/topic_survey.h"
#include "esim/formats/ros/truth_assembler.h"

namespace esim::inline formats::ros {
namespace {

using Part = TruthAssembler::Part;

constexpr std::size_t kPortion = 1U << 16;  // events

std::string described(const Channel& channel) {
  return channel.topic + " (" + (channel.type_name.empty() ? "no type" : channel.type_name) + ")";
}

/// Data for one time that precede the message to which they belong.
template <typename T>
struct Remembered {
  TimeNs t = 0;
  std::optional<T> value{};

  const T* at(TimeNs time) const { return value && t == time ? &*value : nullptr; }
};

struct CameraState {
  TruthAssembler truth{};
  bool has_frame_info = false;  // every frame has it; an image without it is a picture of the irradiance
  Remembered<FrameInfoMessage> frame_info{};
  Image<std::uint16_t> frame{};
  EventPacketDecoder packets{};
};

class RosSource final : public Source {
 public:
  RosSource(std::unique_ptr<MessageInput> input, TopicSurvey survey);

  const RecordingInfo& info() const override { return survey_.info; }
  const Record* next() override;
  std::vector<std::string> not_read() const override;
  double progress() const override { return input_->progress(); }

 private:
  using Result = std::optional<Record>;

  const Record* hold(const Result& result) { return result ? &record_.emplace(*result) : nullptr; }
  const Record* next_events();
  const Record* next_trigger();
  const Record* last_truth();
  Result read(const Message& message);
  Result read_events(const Assignment& to, const Channel& channel, MessageReader& reader);
  Result read_frame(const Assignment& to, const Channel& channel, MessageReader& reader);
  void read_frame_info(const Assignment& to, MessageReader& reader);
  Result read_truth(const Assignment& to, const Channel& channel, MessageReader& reader);
  Result read_imu(MessageReader& reader);
  Result read_transforms(MessageReader& reader);
  CameraState& camera(const Assignment& to) { return cameras_[static_cast<std::size_t>(to.camera)]; }
  bool fits(int camera, std::uint32_t width, std::uint32_t height) const;

  std::unique_ptr<MessageInput> input_;
  TopicSurvey survey_;
  std::vector<CameraState> cameras_;
  std::vector<Event> events_;
  EventSpan rest_;  // events that have not been handed out
  std::vector<EventPacketDecoder::Trigger> triggers_;
  std::size_t next_trigger_ = 0;
  int events_camera_ = 0;
  Remembered<ImuMessage> imu_bias_;
  Remembered<TwistMessage> twist_, accel_;
  PoseRecord pose_;
  Result record_;
  std::set<std::string> passed_over_;  // topics with images that cannot be read
  bool ended_ = false;
  std::exception_ptr damage_;
};

RosSource::RosSource(std::unique_ptr<MessageInput> input, TopicSurvey survey)
    : input_(std::move(input)), survey_(std::move(survey)), cameras_(survey_.info.cameras.size()) {
  pose_.objects.resize(survey_.info.objects.size());
  for (const Assignment& to : survey_.channels) {
    if (to.role == Role::frame_info) camera(to).has_frame_info = true;
    if (to.role == Role::irradiance) camera(to).truth.expect(Part::irradiance);
    if (to.role == Role::depth) camera(to).truth.expect(Part::depth);
    if (to.role == Role::flow) camera(to).truth.expect(Part::flow);
    if (to.role == Role::truth_pose) camera(to).truth.expect(Part::pose);
  }
}

std::vector<std::string> RosSource::not_read() const {
  std::vector<std::string> all(passed_over_.begin(), passed_over_.end());
  for (const Channel& channel : input_->channels()) {
    if (!channel.type) all.push_back(described(channel));
  }
  return all;
}

const Record* RosSource::next() {
  try {
    for (Message message; !ended_;) {
      if (!rest_.empty()) return next_events();
      if (next_trigger_ < triggers_.size()) return next_trigger();
      ended_ = !input_->next(message);
      if (ended_) break;
      try {
        if (const Record* record = hold(read(message))) return record;
      } catch (const Malformed& error) {
        input_->fail(message.offset,
                     "a message on " + input_->channels()[message.channel].topic + " cannot be read: " + error.what());
      }
    }
  } catch (const UserError&) {
    damage_ = std::current_exception();
    ended_ = true;
  }
  if (!damage_) return last_truth();
  std::rethrow_exception(std::exchange(damage_, nullptr));
}

const Record* RosSource::next_events() {
  const EventSpan portion = rest_.first(std::min(rest_.size(), kPortion));
  rest_ = rest_.subspan(portion.size());
  return &record_.emplace(EventsRecord{events_camera_, portion});
}

const Record* RosSource::next_trigger() {
  const EventPacketDecoder::Trigger& trigger = triggers_[next_trigger_++];
  return &record_.emplace(TriggerRecord{events_camera_, trigger.t,
                                        trigger.rising ? TriggerKind::external_rising : TriggerKind::external_falling});
}

/// Data of times at which the file ended early.
const Record* RosSource::last_truth() {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].truth.end();
    if (const Record* record = hold(cameras_[i].truth.take(static_cast<int>(i)))) return record;
  }
  return nullptr;
}

RosSource::Result RosSource::read(const Message& message) {
  if (message.channel >= survey_.channels.size()) return std::nullopt;
  const Assignment& to = survey_.channels[message.channel];
  if (to.role == Role::none || to.role == Role::camera_info) return std::nullopt;
  const Channel& channel = input_->channels()[message.channel];
  MessageReader reader(channel.encoding, message.payload);
  const auto remember = [&]<typename T>(Remembered<T>& memory) {
    reader(memory.value.emplace());
    memory.t = memory.value->header.stamp;
    return std::nullopt;
  };
  switch (to.role) {
    case Role::events:
      return read_events(to, channel, reader);
    case Role::frame:
      return read_frame(to, channel, reader);
    case Role::frame_info:
      return remember(camera(to).frame_info);
    case Role::imu:
      return read_imu(reader);
    case Role::imu_bias:
      return remember(imu_bias_);
    case Role::body_twist:
      return remember(twist_);
    case Role::body_accel:
      return remember(accel_);
    case Role::body_transform:
      return read_transforms(reader);
    case Role::body_pose: {
      PoseMessage pose;
      reader(pose);
      pose_.t = pose.header.stamp;
      pose_.body.T_world_body = checked_pose(pose.pose);
      return pose_;
    }
    default:
      return read_truth(to, channel, reader);
  }
}

RosSource::Result RosSource::read_events(const Assignment& to, const Channel& channel, MessageReader& reader) {
  if (channel.type == MessageType::event_packet) {
    EventPacketMessage packet;
    reader(packet);
    camera(to).packets.decode(packet, events_, triggers_);
    next_trigger_ = 0;
  } else {
    EventArrayHead head;
    reader(head);
    ros::read_events(reader, events_);
  }
  rest_ = events_;
  events_camera_ = to.camera;
  return std::nullopt;
}

bool RosSource::fits(int camera, std::uint32_t width, std::uint32_t height) const {
  const Camera& model = survey_.info.cameras[static_cast<std::size_t>(camera)].model;
  return width == static_cast<std::uint32_t>(model.width) && height == static_cast<std::uint32_t>(model.height);
}

RosSource::Result RosSource::read_frame(const Assignment& to, const Channel& channel, MessageReader& reader) {
  ImageMessage message;
  reader(message);
  if (!fits(to.camera, message.width, message.height)) return std::nullopt;
  CameraState& state = camera(to);
  const TimeNs t = message.header.stamp;
  const FrameInfoMessage* info = state.frame_info.at(t);
  if (info == nullptr && state.has_frame_info) return std::nullopt;
  const int bits = to_frame(message, state.frame);
  if (bits == 0) {
    passed_over_.insert(channel.topic + " (images encoded as " + message.encoding + ")");
    return std::nullopt;
  }
  if (info == nullptr) return FrameRecord{to.camera, t, t, 0, 1, state.frame, bits};
  return FrameRecord{to.camera,
                     t,
                     info->exposure_start_ns,
                     info->exposure_duration_ns,
                     info->gain,
                     state.frame,
                     std::min<int>(std::max<int>(info->bits, 1), bits)};
}

RosSource::Result RosSource::read_truth(const Assignment& to, const Channel& channel, MessageReader& reader) {
  TruthAssembler& truth = camera(to).truth;
  if (to.role == Role::truth_pose) {
    PoseMessage message;
    reader(message);
    const SE3 pose = checked_pose(message.pose);
    truth.begin(Part::pose, message.header.stamp).T_world_camera = pose;
  } else if (to.role == Role::flow) {
    FlowMessage message;
    reader(message);
    if (!fits(to.camera, message.width, message.height)) return std::nullopt;
    TruthAssembler::Frame& frame = truth.begin(Part::flow, message.header.stamp);
    to_images(message, frame.motion_x, frame.motion_y);
  } else {
    ImageMessage message;
    reader(message);
    if (!fits(to.camera, message.width, message.height)) return std::nullopt;
    const bool is_depth = to.role == Role::depth;
    Image<float> image;
    if (!to_floats(message, image)) {
      passed_over_.insert(channel.topic + " (images encoded as " + message.encoding + ")");
      return std::nullopt;
    }
    TruthAssembler::Frame& frame = truth.begin(is_depth ? Part::depth : Part::irradiance, message.header.stamp);
    (is_depth ? frame.depth : frame.irradiance) = std::move(image);
  }
  return truth.take(to.camera);
}

RosSource::Result RosSource::read_imu(MessageReader& reader) {
  ImuMessage message;
  reader(message);
  ImuRecord record{message.header.stamp, {message.angular_velocity, message.linear_acceleration}, {}};
  if (const ImuMessage* bias = imu_bias_.at(record.t)) {
    record.bias = {bias->angular_velocity, bias->linear_acceleration};
  }
  return record;
}

RosSource::Result RosSource::read_transforms(MessageReader& reader) {
  TransformsMessage message;
  reader(message);
  bool has_body = false;
  for (const TransformMessage& transform : message.transforms) {
    if (transform.header.frame_id != frame::kWorld) continue;
    const std::vector<std::string>& objects = survey_.info.objects;
    const auto object = std::find(objects.begin(), objects.end(), transform.child_frame_id);
    if (object != objects.end()) {
      pose_.objects[static_cast<std::size_t>(object - objects.begin())].T_world_body =
          checked_pose(transform.T_frame_child);
    }
    if (transform.child_frame_id != frame::kBody) continue;
    has_body = true;
    pose_.t = transform.header.stamp;
    pose_.body = {};
    pose_.body.T_world_body = checked_pose(transform.T_frame_child);
  }
  if (!has_body) return std::nullopt;
  const Eigen::Quaterniond& R_world_body = pose_.body.T_world_body.rotation;
  if (const TwistMessage* twist = twist_.at(pose_.t)) {
    pose_.body.velocity_world = R_world_body * twist->linear;
    pose_.body.omega_body = twist->angular;
  }
  if (const TwistMessage* accel = accel_.at(pose_.t)) {
    pose_.body.acceleration_world = R_world_body * accel->linear;
    pose_.body.alpha_body = accel->angular;
  }
  return pose_;
}

bool has_no_role(const Assignment& to) { return to.role == Role::none; }

[[noreturn]] void fail_for_want_of_topics(const std::filesystem::path& path, const std::vector<Channel>& channels) {
  std::vector<std::string> found;
  for (const Channel& channel : channels) found.push_back(described(channel));
  throw UserError(
      "cannot read " + path.string() + ": " +
      (found.empty() ? "it holds no topics" : "none of its topics has a supported type: " + list_of_some(found)) +
      "; supported types: " + known_names());
}

}  // namespace

std::unique_ptr<Source> make_source(const std::filesystem::path& path,
                                    const std::function<std::unique_ptr<MessageInput>()>& open,
                                    const ReadOptions& options) {
  const std::unique_ptr<MessageInput> surveyed = open();
  TopicSurvey survey = survey_topics(*surveyed, options);
  if (!survey.damaged && std::all_of(survey.channels.begin(), survey.channels.end(), has_no_role))
    fail_for_want_of_topics(path, surveyed->channels());
  return std::make_unique<RosSource>(open(), std::move(survey));
}

}  // namespace esim::inline formats::ros

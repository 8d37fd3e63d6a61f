#include "esim/formats/ros/topic_survey.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "esim/core/error.h"
#include "esim/formats/ros/messages/event_array.h"
#include "esim/formats/ros/messages/event_packet.h"
#include "esim/formats/ros/messages/sensor_messages.h"

namespace esim::inline formats::ros {
namespace {

constexpr std::uint64_t kMaxBytes = 1U << 26;
constexpr std::uint32_t kMaxImageExtent = 65536;  // px

/// Facts from the first message of a channel.
struct Facts {
  std::optional<TimeNs> start{};
  std::uint32_t width = 0, height = 0;  // px
  std::optional<Camera> camera{};
};

class Surveyor {
 public:
  /// Returns false when nothing more can be learned.
  bool look(const MessageInput& input, const Message& message);
  TopicSurvey conclude(const MessageInput& input, const ReadOptions& options) const;

 private:
  template <typename T>
  static T decode(const Channel& channel, Bytes payload) {
    T message;
    MessageReader(channel.encoding, payload)(message);
    return message;
  }

  void look_at_first(const Channel& channel, Bytes payload, Facts& facts);
  void look_at_transforms(const Channel& channel, Bytes payload);
  CameraInfo camera(const std::string& name, int index, const std::vector<Assignment>& channels,
                    const ReadOptions& options) const;
  SE3 pose_in_body(const std::string& frame) const;

  std::map<std::size_t, Facts> facts_;  // channels seen so far
  std::map<std::string, SE3> T_body_frames_;
  bool has_body_ = false;
  std::vector<std::string> objects_;
  std::uint64_t bytes_ = 0;
};

bool Surveyor::look(const MessageInput& input, const Message& message) {
  const Channel& channel = input.channels()[message.channel];
  bytes_ += message.payload.size();
  if (channel.type == MessageType::transforms) look_at_transforms(channel, message.payload);
  if (channel.type && !facts_.contains(message.channel)) {
    look_at_first(channel, message.payload, facts_[message.channel]);
  }
  if (!input.times()) return true;
  const auto known = std::count_if(input.channels().begin(), input.channels().end(),
                                   [](const Channel& other) { return other.type.has_value(); });
  return bytes_ < kMaxBytes && facts_.size() < static_cast<std::size_t>(known);
}

void Surveyor::look_at_first(const Channel& channel, Bytes payload, Facts& facts) {
  if (channel.type == MessageType::events) {
    MessageReader reader(channel.encoding, payload);
    EventArrayHead head;
    reader(head);
    facts.width = head.width, facts.height = head.height;
    std::vector<Event> events;
    read_events(reader, events);
    if (!events.empty()) facts.start = events.front().t;
  } else if (channel.type == MessageType::event_packet) {
    const auto message = decode<EventPacketMessage>(channel, payload);
    facts = {message.header.stamp, message.width, message.height};
  } else if (channel.type == MessageType::image) {
    const auto message = decode<ImageMessage>(channel, payload);
    facts = {message.header.stamp, message.width, message.height};
  } else if (channel.type == MessageType::flow) {
    const auto message = decode<FlowMessage>(channel, payload);
    facts = {message.header.stamp, message.width, message.height};
  } else if (channel.type == MessageType::camera_info) {
    const auto message = decode<CameraInfoMessage>(channel, payload);
    facts = {message.header.stamp, message.width, message.height, to_camera(message)};
  } else if (channel.type == MessageType::transforms) {
    const auto message = decode<TransformsMessage>(channel, payload);
    if (!message.transforms.empty()) facts.start = message.transforms.front().header.stamp;
  } else {
    facts.start = decode<Header>(channel, payload).stamp;
  }
}

void Surveyor::look_at_transforms(const Channel& channel, Bytes payload) {
  const bool is_static = channel.topic == topic::kStaticTransforms;
  if (!is_static && (has_body_ || channel.topic != topic::kTransforms)) return;
  const auto message = decode<TransformsMessage>(channel, payload);
  std::vector<std::string> others;
  for (const TransformMessage& transform : message.transforms) {
    const std::string& child = transform.child_frame_id;
    if (is_static && transform.header.frame_id == frame::kBody) {
      T_body_frames_[child] = checked_pose(transform.T_frame_child);
    }
    if (is_static || transform.header.frame_id != frame::kWorld) continue;
    child == frame::kBody ? void(has_body_ = true) : others.push_back(child);
  }
  if (has_body_ && !is_static) objects_ = std::move(others);
}

CameraInfo Surveyor::camera(const std::string& name, int index, const std::vector<Assignment>& channels,
                            const ReadOptions& options) const {
  CameraInfo info;
  info.name = name;
  const auto facts_of = [&](Role role) -> const Facts* {
    for (const auto& [channel, facts] : facts_) {
      if (channels[channel].role == role && channels[channel].camera == index) return &facts;
    }
    return nullptr;
  };
  if (const Facts* facts = facts_of(Role::camera_info); facts != nullptr && facts->camera) info.model = *facts->camera;
  for (const Role role : {Role::events, Role::camera_info, Role::frame, Role::irradiance, Role::depth, Role::flow}) {
    const Facts* facts = facts_of(role);
    if (facts == nullptr || facts->width == 0 || facts->width > kMaxImageExtent || facts->height > kMaxImageExtent)
      continue;
    info.model.width = static_cast<int>(facts->width), info.model.height = static_cast<int>(facts->height);
    break;
  }
  if (options.sensor) info.model.width = options.sensor->width, info.model.height = options.sensor->height;
  info.T_body_camera = pose_in_body(name);
  return info;
}

SE3 Surveyor::pose_in_body(const std::string& frame) const {
  const auto found = T_body_frames_.find(frame);
  return found != T_body_frames_.end() ? found->second : SE3();
}

TopicSurvey Surveyor::conclude(const MessageInput& input, const ReadOptions& options) const {
  TopicSurvey result;
  Assignments roles = assign_roles(input.channels(), has_body_);
  result.channels = std::move(roles.of_channels);
  RecordingInfo& info = result.info;
  for (const std::string& name : roles.cameras) {
    info.cameras.push_back(camera(name, static_cast<int>(info.cameras.size()), result.channels, options));
  }
  std::optional<TimeNs> start, events_start;
  for (const auto& [channel, facts] : facts_) {
    const Role role = result.channels[channel].role;
    if (role == Role::none || !facts.start) continue;
    start = std::min(start.value_or(*facts.start), *facts.start);
    if (role == Role::events) events_start = std::min(events_start.value_or(*facts.start), *facts.start);
  }
  for (const Assignment& channel : result.channels) {
    if (channel.role == Role::frame) info.cameras[static_cast<std::size_t>(channel.camera)].has_frames = true;
    if (channel.role == Role::imu) info.imu.emplace().T_body_imu = pose_in_body(std::string(frame::kImu));
  }
  info.start = start.value_or(0);
  info.start_known = start && start != events_start;  // known if something comes before the first event
  const TimeSpan written = input.times().value_or(TimeSpan{});
  info.end = info.start;
  if (written.start >= 0 && written.end >= written.start)
    info.end += std::min(written.end - written.start, std::numeric_limits<TimeNs>::max() / 4);
  const auto is_camera = [&](const std::string& name) {
    return std::find(roles.cameras.begin(), roles.cameras.end(), name) != roles.cameras.end();
  };
  std::copy_if(objects_.begin(), objects_.end(), std::back_inserter(info.objects), std::not_fn(is_camera));
  return result;
}

}  // namespace

TopicSurvey survey_topics(MessageInput& input, const ReadOptions& options) {
  Surveyor surveyor;
  bool damaged = false;
  try {
    for (Message message; input.next(message);) {
      if (!surveyor.look(input, message)) break;
    }
  } catch (const UserError&) {
    damaged = true;
  } catch (const Malformed&) {
    damaged = true;
  }
  TopicSurvey result = surveyor.conclude(input, options);
  result.damaged = damaged;
  return result;
}

}  // namespace esim::inline formats::ros

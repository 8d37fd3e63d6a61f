#include "esim/live/live_sink.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "esim/formats/ros/messages/message_types.h"
#include "esim/formats/ros/messages/messages.h"
#include "esim/formats/ros/ros_sink.h"
#include "esim/formats/ros/topics.h"
#include "esim/recording/fan_out.h"
#include "esim/represent/representations.h"

namespace esim::inline live {
namespace {

namespace ros = formats::ros;

constexpr TimeNs kPictureInterval = kNsPerSecond / 30;
constexpr FramePalette kPalette{.on = {0, 92, 230}, .off = {220, 40, 40}, .background = {255, 255, 255}};

/// Sends messages on topics, which become channels of the publications.
class Publisher final : public ros::MessageOutput {
 public:
  explicit Publisher(std::vector<Publication*> publications) : publications_(std::move(publications)) {}

  void write(const std::string& topic, ros::MessageType type, TimeNs t, std::string_view payload) override {
    auto found = channels_.find(topic);
    if (found == channels_.end()) {
      // What is sent once, or rarely.
      const bool latched = type == ros::MessageType::camera_info || topic == ros::topic::kStaticTransforms;
      const Channel channel{topic, ros::ros2_name_of(type), ros::definition_of(type, ros::Encoding::cdr), latched};
      std::vector<std::uint32_t> numbers;
      for (Publication* publication : publications_) numbers.push_back(publication->advertise(channel));
      found = channels_.emplace(topic, std::move(numbers)).first;
    }
    for (std::size_t i = 0; i < publications_.size(); ++i) publications_[i]->publish(found->second[i], t, payload);
  }

  void close() override {}

  template <typename Message>
  void send(const std::string& topic, ros::MessageType type, TimeNs t, const Message& message) {
    ros::MessageWriter(ros::Encoding::cdr, payload_)(message);
    write(topic, type, t, payload_);
  }

 private:
  std::vector<Publication*> publications_;
  std::map<std::string, std::vector<std::uint32_t>> channels_;  // of each publication, by topic
  std::string payload_;
};

/// What recordings do not contain.
class Additions final : public Sink {
 public:
  explicit Additions(const std::vector<Publication*>& publications)
      : publications_(publications), publisher_(publications) {}

  void begin(const RecordingInfo& info) override {
    info_ = info;
    events_.assign(info.cameras.size(), {});
    next_picture_ = info.start + kPictureInterval;
  }

  void write(const Record& record) override {
    if (const auto* events = std::get_if<EventsRecord>(&record)) {
      std::vector<Event>& waiting = events_[static_cast<std::size_t>(events->camera)];
      for (const Event& event : events->events) {
        pass_to(event.t);
        waiting.push_back(event);
      }
    } else if (const auto* pose = std::get_if<PoseRecord>(&record)) {
      pass_to(pose->t);
      send_odometry(*pose);
    }
  }

  void end(bool) override {}

 private:
  /// Sends the pictures that are due.
  void pass_to(TimeNs t) {
    for (; next_picture_ <= t; next_picture_ += kPictureInterval) {
      for (std::size_t i = 0; i < events_.size(); ++i) {
        const CameraInfo& camera = info_.cameras[i];
        const int width = camera.model.width, height = camera.model.height;
        const std::vector<std::uint8_t> pixels = event_frame(events_[i], width, height, kPalette);
        ros::ImageMessage picture;
        picture.header = {next_picture_, ros::ros_name(camera.name)};
        picture.width = static_cast<std::uint32_t>(width), picture.height = static_cast<std::uint32_t>(height);
        picture.encoding = "rgb8", picture.step = 3 * picture.width;
        picture.data = std::as_bytes(std::span(pixels));
        publisher_.send(ros::camera_topic(camera.name, "event_image"), ros::MessageType::image, next_picture_, picture);
        events_[i].clear();
      }
    }
  }

  void send_odometry(const PoseRecord& pose) {
    for (Publication* publication : publications_) publication->publish_time(pose.t);
    publisher_.send("/clock", ros::MessageType::clock, pose.t, ros::ClockMessage{pose.t});
    const Kinematics& body = pose.body;
    ros::OdometryMessage odometry;
    odometry.header = {pose.t, ros::ros_name(ros::frame::kWorld)};
    odometry.child_frame_id = ros::ros_name(ros::frame::kBody);
    odometry.pose = body.T_world_body;
    odometry.linear = body.T_world_body.rotation.conjugate() * body.velocity_world;
    odometry.angular = body.omega_body;
    publisher_.send("/odom", ros::MessageType::odometry, pose.t, odometry);
  }

  std::vector<Publication*> publications_;
  Publisher publisher_;
  RecordingInfo info_;
  std::vector<std::vector<Event>> events_;  // of each camera, since its last picture
  TimeNs next_picture_ = 0;
};

}  // namespace

std::unique_ptr<Sink> make_live_sink(const std::vector<Publication*>& publications) {
  auto all = std::make_unique<FanOut>();
  all->add(ros::make_sink(
      "the live messages", ros::Encoding::cdr, ros::PacketEncoding::evt3,
      [publications] { return std::make_unique<Publisher>(publications); }, true));
  all->add(std::make_unique<Additions>(publications));
  return all;
}

}  // namespace esim::inline live

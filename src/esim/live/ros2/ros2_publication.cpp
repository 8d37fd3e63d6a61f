#include "esim/live/ros2/ros2_publication.h"

#include "esim/core/error.h"

#ifdef ESIM_ROS2
#include <dds/dds.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <utility>
#include <vector>

#include "esim/live/ros2/raw_type.h"

namespace esim::inline live {
namespace {

constexpr int kKept = 50;  // messages of a writer that slow readers can still have

/// REP 2016: what identifies the definition of a type.
struct TypeHash {
  std::string_view name, hash;
};
constexpr std::array kTypeHashes = {
    TypeHash{"sensor_msgs/msg/Image", "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    TypeHash{"sensor_msgs/msg/CameraInfo", "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
    TypeHash{"sensor_msgs/msg/Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    TypeHash{"geometry_msgs/msg/PoseStamped", "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    TypeHash{"geometry_msgs/msg/TwistStamped", "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"},
    TypeHash{"geometry_msgs/msg/AccelStamped", "ef1df9eabae0a708cc049a061ebcddc4e2a5f745730100ba680e086a9698b165"},
    TypeHash{"tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
    TypeHash{"rosgraph_msgs/msg/Clock", "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
    TypeHash{"nav_msgs/msg/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    TypeHash{"event_camera_msgs/msg/EventPacket", "d6fa176260b1f37e5a40845305315e150a0f18191241eb64f407442aa29844aa"},
    TypeHash{"esim_msgs/msg/OpticFlow", "91e2cfaf5fdf5a2053aa8d943d7e3b133f4dbc1092f6676399316b66409f30af"},
    TypeHash{"esim_msgs/msg/FrameInfo", "c6990e44ab06abfa3041e6d2838d1eb001ff15d2e7b88635a5fbb363596d3796"},
};

/// "sensor_msgs::msg::dds_::Image_"
std::string dds_name(std::string_view schema_name) {
  std::string name;
  const std::size_t last = schema_name.rfind('/');
  for (const char c : schema_name.substr(0, last)) name += c == '/' ? std::string("::") : std::string(1, c);
  return name + "::dds_::" + std::string(schema_name.substr(last + 1)) + "_";
}

/// The settings of DDS for programs on this machine. Others are found by multicast on the loopback interface, as ROS 2
/// does with ROS_LOCALHOST_ONLY, or by their numbers.
constexpr const char* kThisMachine =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/></Interfaces>"
    "</General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</"
    "MaxAutoParticipantIndex>"
    "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>";

}  // namespace

struct Ros2Publication::Impl {
  dds_entity_t add_topic(const std::string& topic, std::string_view schema_name) const;
  void read(const std::string& topic, const std::string& schema_name);

  std::function<void(const ClientMessage&)> message;
  dds_entity_t domain = 0, participant = 0;
  std::mutex mutex;
  std::vector<std::pair<std::string, dds_entity_t>> writers;  // topic, writer; channel i + 1
  std::atomic<std::int64_t> dropped{0};

  /// A subscription, for the listener.
  struct Subscription {
    Impl* publication;
    ClientMessage form;
  };
  std::vector<std::unique_ptr<Subscription>> subscriptions;
};

dds_entity_t Ros2Publication::Impl::add_topic(const std::string& topic, std::string_view schema_name) const {
  const dds_entity_t made = create_raw_topic(participant, ("rt" + topic).c_str(), dds_name(schema_name).c_str());
  if (made < 0) throw InternalError(fmt::format("ROS 2: cannot create the topic {}: {}", topic, dds_strretcode(made)));
  return made;
}

void Ros2Publication::Impl::read(const std::string& topic, const std::string& schema_name) {
  Subscription& subscription =
      *subscriptions.emplace_back(std::make_unique<Subscription>(Subscription{this, {topic, "cdr", schema_name, {}}}));
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);  // matches all writers
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_listener_t* const listener = dds_create_listener(&subscription);
  dds_lset_data_available(listener, [](dds_entity_t reader, void* argument) {
    auto& from = *static_cast<Subscription*>(argument);
    ClientMessage taken = from.form;
    void* sample = &taken.payload;
    dds_sample_info_t info;
    while (dds_take(reader, &sample, &info, 1, 1) > 0)
      if (info.valid_data) from.publication->message(taken);
  });
  const dds_entity_t reader = dds_create_reader(participant, add_topic(topic, schema_name), qos, listener);
  dds_delete_listener(listener);
  dds_delete_qos(qos);
  if (reader < 0) throw InternalError(fmt::format("ROS 2: cannot read {}: {}", topic, dds_strretcode(reader)));
}

Ros2Publication::Ros2Publication(const Options& options, std::function<void(const ClientMessage&)> message)
    : impl_(std::make_unique<Impl>()) {
  if (options.domain < 0 || options.domain > 232)  // the ports of others do not exist
    throw UserError(fmt::format("ROS domain {}: must be from 0 to 232", options.domain));
  const auto domain = static_cast<dds_domainid_t>(options.domain);
  impl_->message = std::move(message);
  if (!options.network) impl_->domain = dds_create_domain(domain, kThisMachine);
  impl_->participant = impl_->domain < 0 ? impl_->domain : dds_create_participant(domain, nullptr, nullptr);
  if (impl_->participant < 0)
    throw UserError(
        fmt::format("ROS 2: DDS does not start in domain {}: {}", options.domain, dds_strretcode(impl_->participant)));
  impl_->read("/esim/pose", "geometry_msgs/msg/PoseStamped");
  impl_->read("/esim/twist", "geometry_msgs/msg/TwistStamped");
}

Ros2Publication::~Ros2Publication() {
  dds_delete(impl_->participant);
  if (impl_->domain > 0) dds_delete(impl_->domain);
}

std::uint32_t Ros2Publication::advertise(Channel channel) {
  const std::lock_guard lock(impl_->mutex);
  auto& writers = impl_->writers;
  const auto found =
      std::find_if(writers.begin(), writers.end(), [&](const auto& one) { return one.first == channel.topic; });
  const auto id = static_cast<std::uint32_t>(found - writers.begin() + 1);
  if (found != writers.end()) return id;
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);  // without waiting for readers
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, channel.latched ? 1 : kKept);
  if (channel.latched) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const auto hash = std::find_if(kTypeHashes.begin(), kTypeHashes.end(),
                                 [&](const TypeHash& one) { return one.name == channel.schema_name; });
  if (hash != kTypeHashes.end()) {
    const std::string data = fmt::format("typehash=RIHS01_{};", hash->hash);
    dds_qset_userdata(qos, data.data(), data.size());
  }
  const dds_entity_t writer =
      dds_create_writer(impl_->participant, impl_->add_topic(channel.topic, channel.schema_name), qos, nullptr);
  dds_delete_qos(qos);
  if (writer < 0)
    throw InternalError(fmt::format("ROS 2: cannot publish {}: {}", channel.topic, dds_strretcode(writer)));
  writers.emplace_back(std::move(channel.topic), writer);
  return id;
}

void Ros2Publication::publish(std::uint32_t channel, TimeNs, std::string_view payload) {
  dds_entity_t writer = 0;
  {
    const std::lock_guard lock(impl_->mutex);
    writer = impl_->writers.at(channel - 1).second;
  }
  const std::string sample(payload);
  if (dds_write(writer, &sample) < 0) ++impl_->dropped;
}

std::int64_t Ros2Publication::dropped() const { return impl_->dropped; }

}  // namespace esim::inline live

#else

namespace esim::inline live {

struct Ros2Publication::Impl {};

Ros2Publication::Ros2Publication(const Options&, std::function<void(const ClientMessage&)>) {
  throw UserError(
      "this program was built without ROS 2; build esim with -DESIM_ROS2=ON and Cyclone DDS (Debian: cyclonedds-dev)");
}
Ros2Publication::~Ros2Publication() = default;
std::uint32_t Ros2Publication::advertise(Channel) { return 0; }
void Ros2Publication::publish(std::uint32_t, TimeNs, std::string_view) {}
std::int64_t Ros2Publication::dropped() const { return 0; }

}  // namespace esim::inline live

#endif

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "esim/core/time.h"

namespace esim::inline live {

/// A topic with messages in ROS 2's encoding (CDR).
struct Channel {
  std::string topic{};
  std::string schema_name{};  ///< "sensor_msgs/msg/Image"
  std::string schema{};       ///< its definition, with those of all types in it
  bool latched = false;       ///< new subscribers receive the last message
};

/// A message that a client publishes.
struct ClientMessage {
  std::string topic{}, encoding{}, schema_name{};
  std::string payload{};
};

/// Where messages are published. Functions may be called from any thread, and never wait for readers.
class Publication {
 public:
  virtual ~Publication() = default;

  /// Adds a channel, unless there is one of the same topic. Returns its number for publish().
  virtual std::uint32_t advertise(Channel channel) = 0;

  /// Sends a message to the channel's subscribers.
  virtual void publish(std::uint32_t channel, TimeNs t, std::string_view payload) = 0;

  /// Sends the simulated time, if there is a way beside the topics.
  virtual void publish_time(TimeNs t) = 0;

  /// Number of messages that slow readers have lost.
  virtual std::int64_t dropped() const = 0;
};

}  // namespace esim::inline live

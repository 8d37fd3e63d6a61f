#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "esim/live/publication.h"

namespace esim::inline live {

/// Publishes messages to ROS 2 over DDS, as a node without a ROS installation: topics, types, type hashes and qualities
/// of service are those that ROS 2 expects. Writers are reliable and keep the last messages; latched ones are
/// transient-local.
class Ros2Publication final : public Publication {
 public:
  struct Options {
    int domain = 0;  ///< ROS_DOMAIN_ID
    bool network =
        false;  ///< as CYCLONEDDS_URI says; false: only programs on this machine, as with ROS_LOCALHOST_ONLY=1
  };

  /// `message` receives poses and twists that others publish on /esim/pose and /esim/twist, on a thread of DDS; it must
  /// not throw. Throws UserError if the program was built without DDS, or if it
  /// cannot start.
  Ros2Publication(const Options& options, std::function<void(const ClientMessage&)> message);
  ~Ros2Publication() override;
  Ros2Publication(const Ros2Publication&) = delete;
  Ros2Publication& operator=(const Ros2Publication&) = delete;

  std::uint32_t advertise(Channel channel) override;
  void publish(std::uint32_t channel, TimeNs t, std::string_view payload) override;
  void publish_time(TimeNs) override {}  // /clock says it
  std::int64_t dropped() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline live

#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "esim/compose/compose.h"
#include "esim/live/foxglove_server.h"
#include "esim/live/ros2/ros2_publication.h"

namespace esim::inline live {

struct ServeOptions {
  FoxgloveServer::Place place{};
  std::optional<Ros2Publication::Options> ros2{};  ///< unset: without ROS 2
  double speed = 1;                                ///< simulated seconds per second; 0: as fast as possible
  bool loop = false;                               ///< begins again at the end
  bool paused = false;                             ///< at the beginning
  int threads = 0;                                 ///< 0: every processor
  bool live_pose = false;                          ///< clients move the body; the trajectory only gives the first pose
  double pose_interval_s = 0.005;                  ///< time between two poses of the body, if clients move it
  double max_jump_m = 1;                           ///< larger jumps of a pose are refused
};

/// A simulation that publishes what it makes while it runs, and that clients of its server control.
///
/// Parameters that clients can set: `paused`; `speed`; `step_s`, to simulate so long and pause; `restart` (true). To
/// read: `time_s`, `clock_s`, `real_time_factor`, `dropped_messages`, `poses`, `refused_poses`.
///
/// With `live_pose`, clients of the server, and with `ros2` other nodes, publish geometry_msgs/PoseStamped on
/// /esim/pose or geometry_msgs/TwistStamped on /esim/twist (of the body, in its own frame), in CDR or JSON. A pose
/// holds until the next; a twist moves the body from the last pose until another message comes.
class Server {
 public:
  /// Listens. Throws UserError if the address cannot be listened on, or the options are out of range.
  Server(const Scenario& scenario, const ServeOptions& options);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  int port() const;

  /// Simulates until the end of the scenario, or until stop(). Throws UserError for problems of the scenario.
  void run(const Notices& notices);

  /// Ends run(). From any thread, but not from a signal handler.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline live

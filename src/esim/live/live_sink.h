#pragma once

#include <memory>

#include "esim/live/foxglove_server.h"
#include "esim/recording/record.h"

namespace esim::inline live {

/// Publishes a simulation: the topics of a ROS 2 recording, with events as EventPackets; /clock, /odom (of the body),
/// and for viewers, pictures of the events as CAMERA/event_image, 30 per simulated second. The server must outlive it.
std::unique_ptr<Sink> make_live_sink(FoxgloveServer& server);

}  // namespace esim::inline live

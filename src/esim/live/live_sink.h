#pragma once

#include <memory>
#include <vector>

#include "esim/live/publication.h"
#include "esim/recording/record.h"

namespace esim::inline live {

/// Publishes a simulation: the topics of a ROS 2 recording, with events as EventPackets; /clock, /odom (of the body),
/// and for viewers, pictures of the events as CAMERA/event_image, 30 per simulated second. The
/// publications must outlive it.
std::unique_ptr<Sink> make_live_sink(const std::vector<Publication*>& publications);

}  // namespace esim::inline live

#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// ROS 1 bags, format 2.0. rosbag_packets_format() writes events as EventPackets, like the drivers of event cameras;
/// rosbag_format() as EventArrays. Both read either.
Format rosbag_format();
Format rosbag_packets_format();

}  // namespace esim::inline formats

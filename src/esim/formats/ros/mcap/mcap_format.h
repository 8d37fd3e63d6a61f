#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// MCAP with ROS 2 messages. mcap_packets_format() writes events as EventPackets, like the drivers of event cameras;
/// mcap_format() as EventArrays. Both read either.
Format mcap_format();
Format mcap_packets_format();

}  // namespace esim::inline formats

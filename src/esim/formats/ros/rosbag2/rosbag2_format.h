#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Bags of ROS 2: a folder with metadata.yaml and SQLite files; when they are read, also with MCAP files.
/// rosbag2_packets_format() writes events as EventPackets, rosbag2_format() as EventArrays. Both read either.
Format rosbag2_format();
Format rosbag2_packets_format();

/// A single SQLite file of such a bag. Read only.
Format rosbag2_file_format();

}  // namespace esim::inline formats

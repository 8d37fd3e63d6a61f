#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// ROS 1 bags, format 2.0.
Format rosbag_format();

}  // namespace esim::inline formats

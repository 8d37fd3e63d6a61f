#pragma once

#include "esim/record/format.h"

namespace esim {

/// ROS 1 bags, format 2.0.
Format rosbag_format();

}  // namespace esim

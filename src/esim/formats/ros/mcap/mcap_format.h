#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// MCAP with ROS 2 messages.
Format mcap_format();

}  // namespace esim::inline formats

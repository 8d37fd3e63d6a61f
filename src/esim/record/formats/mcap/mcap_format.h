#pragma once

#include "esim/record/format.h"

namespace esim {

/// MCAP with ROS 2 messages.
Format mcap_format();

}  // namespace esim

#pragma once

#include "esim/record/format.h"

namespace esim {

/// MCAP with messages of ROS 2.
Format mcap_format();

}  // namespace esim

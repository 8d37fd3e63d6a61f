#pragma once

#include <string>

#include "esim/record/record.h"

namespace esim {

/// The cameras of a recording as a rig file of the original ESIM: each with its model and T_B_C, the pose of the camera
/// in the body frame. Numbers read back as they are. The format has no place for an IMU.
std::string rig_yaml(const RecordingInfo& info);

}  // namespace esim

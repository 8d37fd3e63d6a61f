#pragma once

#include <filesystem>
#include <memory>

#include "esim/recording/format.h"

namespace esim::inline formats {

/// The Event Camera Dataset's layout (Mueggler et al., IJRR 2017), as a zip, in which it is published, and as a folder:
///
///   events.txt       t x y p                   s, px, px, 1 (ON) or 0 (OFF)
///   images.txt       t images/frame_00000000.png
///   imu.txt          t ax ay az gx gy gz       m/s^2 (specific force), rad/s
///   groundtruth.txt  t px py pz qx qy qz qw    T_world_body; m, Hamilton quaternion
///   calib.txt        fx fy cx cy k1 k2 p1 p2 k3
///
/// All of one camera. Only events.txt is required. The first image determines the size of the sensor.
Format dataset_format();
Format dataset_folder_format();

}  // namespace esim::inline formats

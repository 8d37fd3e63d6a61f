#pragma once

namespace esim {

// Names of a dataset's files.
inline constexpr char kEventsTxt[] = "events.txt", kImagesTxt[] = "images.txt", kImuTxt[] = "imu.txt",
                      kGroundTruthTxt[] = "groundtruth.txt", kCalibTxt[] = "calib.txt";

}  // namespace esim

#pragma once

namespace esim::inline formats {

// Names of the files of a dataset.
inline constexpr char kEventsTxt[] = "events.txt", kImagesTxt[] = "images.txt", kImuTxt[] = "imu.txt",
                      kGroundTruthTxt[] = "groundtruth.txt", kCalibTxt[] = "calib.txt";

}  // namespace esim::inline formats

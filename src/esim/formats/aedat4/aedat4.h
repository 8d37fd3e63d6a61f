#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// AEDAT 4.0, the format of iniVation's DV, dv-processing and their cameras: events, frames and the IMU. Reads any
/// compression (LZ4, Zstd, none), also files that are truncated or lack the table of packets; other contents (triggers,
/// results of trackers) are skipped. Writes a stream of events and one of frames for each camera, and one stream of the
/// IMU. Times are in us.
///
/// Frames are grey: colour is converted to grey on reading, and numbers of more than 8 bits are stored with 16.
Format aedat4_format();

/// The same, but writes with Zstd compression: smaller, slower.
Format aedat4_zstd_format();

}  // namespace esim::inline formats

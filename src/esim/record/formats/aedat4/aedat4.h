#pragma once

#include "esim/record/format.h"

namespace esim {

/// AEDAT 4.0, the format of iniVation's DV, dv-processing and their cameras: events, frames and the IMU. Any packing is
/// read (LZ4, Zstd, none), also from files that end early or lack the table of packets; what else is in them
/// (triggers, the results of trackers) is passed over. Written are, for each camera, a stream of events and one of
/// frames, and one stream of the IMU. Times are in us.
///
/// Frames are grey: colours are turned into grey when they are read, and numbers of more than 8 bits are stored as 16.
Format aedat4_format();

/// Likewise, but what it writes is packed with Zstd: smaller, slower.
Format aedat4_zstd_format();

}  // namespace esim

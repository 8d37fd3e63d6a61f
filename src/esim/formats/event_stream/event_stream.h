#pragma once

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Event Stream 2.0, `.es`: DVS streams, and the events of ATIS streams.
Format event_stream_format();

}  // namespace esim::inline formats

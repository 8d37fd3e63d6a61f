#pragma once

#include "events/packet_sink.h"

namespace esim::python {

/// A packet as a dict of arrays, which own the memory.
nb::dict to_dict(Packet packet, const RecordingInfo& info);

/// The cameras, the span of time and the moving objects of a recording.
nb::dict to_dict(const RecordingInfo& info);

}  // namespace esim::python

#pragma once

#include <dds/dds.h>

#include <string>

// Private to live/ros2: includes dds/dds.h.
namespace esim::inline live {

/// Creates a topic of a type without keys, of which Cyclone DDS knows only the name: samples are strings with a message
/// in CDR, with its encoding header. Negative on failure.
dds_entity_t create_raw_topic(dds_entity_t participant, const char* name, const char* type_name);

}  // namespace esim::inline live

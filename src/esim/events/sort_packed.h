#pragma once

#include <cstdint>
#include <span>

#include "esim/events/event_packing.h"

namespace esim::inline events {

/// Sorts packed events: a radix sort over the bits in which their times differ. `scratch` is as long as `events`.
void sort_packed(std::span<std::uint64_t> events, std::span<std::uint64_t> scratch, const EventPacking& packing);

}  // namespace esim::inline events

#pragma once

#include <filesystem>
#include <memory>

#include "esim/record/formats/aedat4/packing.h"
#include "esim/record/record.h"

namespace esim::aedat4 {

/// Packets of events hold at most 16384 events, or 100 ms. A killed process leaves a file without the table of packets.
/// The same records give the same bytes.
std::unique_ptr<Sink> make_writer(std::filesystem::path path, Packing packing);

}  // namespace esim::aedat4

#pragma once

#include <filesystem>
#include <memory>

#include "esim/formats/aedat4/packing.h"
#include "esim/recording/record.h"

namespace esim::inline formats::aedat4 {

/// Packets of events hold at most 16384 events, or 100 ms. A killed process leaves a file without the table of packets.
/// The same records give the same bytes.
std::unique_ptr<Sink> make_writer(std::filesystem::path path, Packing packing);

}  // namespace esim::inline formats::aedat4

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "esim/files/input_file.h"
#include "esim/recording/format.h"

namespace esim::inline formats::jaer {

inline constexpr std::string_view kSignature = "#!AER-DAT";
inline constexpr int kMaxDavisWidth = 1024, kMaxDavisHeight = 512;  // px, by the bits of the addresses

/// What the bits of addresses mean.
enum class Layout { davis, dvs128 };

/// Chip and sensor of a file.
struct Chip {
  Layout layout = Layout::davis;
  SensorSize sensor{};
};

/// Reads the header, lines that start with '#'; the next byte is the first of the events. Throws UserError for other
/// versions and chips, and RemediableError (sensor_size) if the header does not state the chip or its size, and the
/// caller does not state the size either.
Chip read_header(InputFile& file, const std::optional<SensorSize>& stated);

/// The header of a file with addresses in the layout of DAVIS.
std::string davis_header(SensorSize sensor);

}  // namespace esim::inline formats::jaer

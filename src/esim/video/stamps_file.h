#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline video {

/// One line of a file of time stamps.
struct StampedName {
  TimeNs t = 0;
  std::string name;  ///< of the image; empty if the file gives none
};

/// Reads images.csv: lines `timestamp in ns, file`. Both functions skip comments (#), empty lines and a heading, and
/// throw UserError naming file and line for any other line. They do not check the order of the times.
std::vector<StampedName> read_images_csv(const std::filesystem::path& path);

/// Reads timestamps.txt: lines `seconds`, `seconds file` or `index seconds file`, all of the same kind.
std::vector<StampedName> read_timestamps_txt(const std::filesystem::path& path);

/// Parses seconds such as "12.5" or "1.25e1" to nanoseconds, exact without an exponent; nothing if it is not a number.
std::optional<TimeNs> parse_seconds(const std::string& text);

}  // namespace esim::inline video

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"

namespace esim {

/// One line of a file of time stamps.
struct StampedName {
  TimeNs t = 0;
  std::string name;  ///< of the image; empty if the file gives none
};

/// images.csv: lines `timestamp in ns, file`. Here as below, comments (#), empty lines and a heading are passed over,
/// and anything else that is not such a line is a UserError naming file and line. The order of the times is not looked
/// at.
std::vector<StampedName> read_images_csv(const std::filesystem::path& path);

/// timestamps.txt: lines `seconds`, `seconds file` or `index seconds file`, all of one kind.
std::vector<StampedName> read_timestamps_txt(const std::filesystem::path& path);

/// "12.5" or "1.25e1" as nanoseconds, exact unless there is an exponent; nothing if it is no such number.
std::optional<TimeNs> parse_seconds(const std::string& text);

}  // namespace esim

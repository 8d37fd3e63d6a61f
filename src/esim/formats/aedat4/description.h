#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace esim::inline formats::aedat4 {

/// One stream of packets in a file's description.
struct Stream {
  int id = 0;
  std::string type{};         ///< four letters: "EVTS"
  std::string source{};       ///< the camera's name
  int width = 0, height = 0;  ///< px; 0 for streams without images
};

/// The description as XML, with the names that DV uses.
std::string describe(const std::vector<Stream>& streams, std::string_view packing);

/// The streams that have a type. Nothing if the text is not a valid description.
std::optional<std::vector<Stream>> parse_description(std::string_view xml);

}  // namespace esim::inline formats::aedat4

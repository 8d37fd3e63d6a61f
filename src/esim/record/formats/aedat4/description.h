#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace esim::aedat4 {

/// One stream of packets, as a file's description tells of it.
struct Stream {
  int id = 0;
  std::string type{};         ///< four letters: "EVTS"
  std::string source{};       ///< the camera's name
  int width = 0, height = 0;  ///< px, of what has them
};

/// The description, XML, in the words of DV.
std::string describe(const std::vector<Stream>& streams, std::string_view packing);

/// Streams that have a type. Nothing where it is no such description.
std::optional<std::vector<Stream>> parse_description(std::string_view xml);

}  // namespace esim::aedat4

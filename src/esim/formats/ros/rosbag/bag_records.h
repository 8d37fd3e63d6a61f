#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "esim/core/time.h"
#include "esim/formats/ros/messages/bytes.h"

namespace esim::inline formats::rosbag {

// ROS bags, format 2.0. After the first line, everything is a record: the length of its header, the header, the length
// of its data, the data. A header is a list of fields: length, then `name=value`; the field "op" is the type of the
// record.

inline constexpr std::string_view kMagic = "#ROSBAG V2.0\n";

enum class Op : std::uint8_t { message = 2, bag_header = 3, index = 4, chunk = 5, chunk_info = 6, connection = 7 };

/// A ROS 1 time: seconds in the lower 32 bits, nanoseconds in the upper ones.
inline std::uint64_t to_ros(TimeNs t) {
  return static_cast<std::uint64_t>(t / kNsPerSecond) | static_cast<std::uint64_t>(t % kNsPerSecond) << 32U;
}

inline TimeNs from_ros(std::uint64_t stored) {
  return static_cast<TimeNs>(stored & 0xffffffffU) * kNsPerSecond + static_cast<TimeNs>(stored >> 32U);
}

/// Appends a record to `out`: first its fields, then end_header(), then its data.
class RecordWriter {
 public:
  RecordWriter(std::string& out, Op op);

  template <typename T>
  RecordWriter& field(std::string_view name, T number) {
    return text(name, {reinterpret_cast<const char*>(&number), sizeof number});
  }
  RecordWriter& text(std::string_view name, std::string_view value);

  /// Ends the header; the caller appends so many bytes of data.
  void end_header(std::size_t data_bytes);
  void end(std::string_view data) {
    end_header(data.size());
    out_ += data;
  }

  std::size_t header_bytes() const { return out_.size() - start_ - sizeof(std::uint32_t); }

 private:
  std::string& out_;
  std::size_t start_;
};

/// The value of a field of a header, borrowed; nothing if it is missing. Throws Malformed if the header is not a list
/// of fields.
std::optional<std::span<const std::byte>> find_field(std::span<const std::byte> header, std::string_view name);

/// A required field.
std::string_view text_field(std::span<const std::byte> header, std::string_view name);

template <typename T>
T field(std::span<const std::byte> header, std::string_view name) {
  return ros::ByteReader(ros::as_bytes(text_field(header, name))).number<T>();
}

/// Appends `name=value` with its length.
void append_field(std::string& out, std::string_view name, std::string_view value);

}  // namespace esim::inline formats::rosbag

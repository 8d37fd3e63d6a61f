#include "esim/formats/ros/rosbag/bag_records.h"

namespace esim::inline formats::rosbag {

RecordWriter::RecordWriter(std::string& out, Op op) : out_(out), start_(out.size()) {
  ros::append_number(out_, std::uint32_t{0});
  field("op", op);
}

RecordWriter& RecordWriter::text(std::string_view name, std::string_view value) {
  append_field(out_, name, value);
  return *this;
}

void RecordWriter::end_header(std::size_t data_bytes) {
  ros::store(out_.data() + start_, static_cast<std::uint32_t>(header_bytes()));
  ros::append_number(out_, static_cast<std::uint32_t>(data_bytes));
}

std::optional<std::span<const std::byte>> find_field(std::span<const std::byte> header, std::string_view name) {
  for (ros::ByteReader fields(header); fields.left() > 0;) {
    const std::string_view text = ros::as_text(fields.counted());
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) throw ros::Malformed("its header is not a list of fields");
    if (text.substr(0, equals) == name) return ros::as_bytes(text.substr(equals + 1));
  }
  return std::nullopt;
}

std::string_view text_field(std::span<const std::byte> header, std::string_view name) {
  const auto value = find_field(header, name);
  if (!value) throw ros::Malformed("it has no field \"" + std::string(name) + "\"");
  return ros::as_text(*value);
}

void append_field(std::string& out, std::string_view name, std::string_view value) {
  ros::append_number(out, static_cast<std::uint32_t>(name.size() + 1 + value.size()));
  out += name;
  out += '=';
  out += value;
}

}  // namespace esim::inline formats::rosbag

#include "esim/formats/ros/rosbag/rosbag_input.h"

#include <algorithm>
#include <utility>

#include "esim/core/error.h"
#include "esim/formats/ros/chunk_codec.h"
#include "esim/formats/ros/rosbag/bag_records.h"

namespace esim::inline formats::rosbag {
namespace {

constexpr std::uint32_t kMaxHeaderBytes = 1U << 20;

Op op_of(std::span<const std::byte> header) { return field<Op>(header, "op"); }

ros::ChunkCodec codec_of(std::span<const std::byte> header) {
  const std::string_view name = text_field(header, "compression");
  if (name == "none") return ros::ChunkCodec::none;
  if (name == "lz4") return ros::ChunkCodec::lz4;
  if (name == "bz2") return ros::ChunkCodec::bz2;
  throw ros::Malformed("the compression \"" + std::string(name) + "\" is not none, lz4 or bz2");
}

}  // namespace

RosbagInput::RosbagInput(std::filesystem::path path) : file_(std::move(path)) {
  if (ros::as_text(file_.read_exactly(kMagic.size(), "its first line")) != kMagic) {
    fail(0, "the bag must have version 2.0; convert older bags with `rosbag fix`");
  }
  read_bag_header();
  const std::uint64_t start = file_.offset();
  if (index_position_ > start && index_position_ < file_.size()) read_index();
  file_.seek(start);
}

void RosbagInput::read_bag_header() {
  Record record;
  if (!next_in_file(record)) fail(file_.offset(), "the bag's header is missing");
  try {
    if (op_of(record.header) != Op::bag_header) throw ros::Malformed("it is a record of another type");
    const auto encryptor = find_field(record.header, "encryptor");
    if (encryptor && !encryptor->empty()) throw ros::Malformed("the bag is encrypted");
    index_position_ = field<std::uint64_t>(record.header, "index_pos");
  } catch (const ros::Malformed& error) {
    fail(record.offset, std::string("the bag's header: ") + error.what());
  }
}

/// If this fails, the bag is read as one without an index.
void RosbagInput::read_index() {
  try {
    file_.seek(index_position_);
    std::optional<TimeSpan> times;
    for (Record record; next_in_file(record);) {
      if (op_of(record.header) == Op::connection) add_connection(record);
      if (op_of(record.header) != Op::chunk_info) continue;
      const TimeSpan chunk{from_ros(field<std::uint64_t>(record.header, "start_time")),
                           from_ros(field<std::uint64_t>(record.header, "end_time"))};
      if (!times) times = chunk;
      times = {std::min(times->start, chunk.start), std::max(times->end, chunk.end)};
    }
    times_ = times.value_or(TimeSpan{});
  } catch (const UserError&) {
  } catch (const ros::Malformed&) {
  }
}

bool RosbagInput::next_in_file(Record& record) {
  record.offset = file_.offset();
  if (record.offset == file_.size()) return false;
  const auto length = [&](std::uint64_t max, std::string_view what) {
    const auto bytes =
        load_unaligned<std::uint32_t>(file_.read_exactly(4, "the length of " + std::string(what)).data());
    if (bytes > max) fail(record.offset, std::string(what) + " is too long: " + std::to_string(bytes) + " bytes");
    return bytes;
  };
  header_ = ros::as_text(file_.read_exactly(length(kMaxHeaderBytes, "a record's header"), "a record's header"));
  record.header = ros::as_bytes(header_);
  record.data = file_.read_exactly(length(ros::kMaxChunkBytes, "a record's data"), "a record's data");
  return true;
}

bool RosbagInput::next_in_chunk(Record& record) {
  if (chunk_.left() == 0) return false;
  record = {chunk_offset_, chunk_.counted(), chunk_.counted()};
  return true;
}

void RosbagInput::open_chunk(const Record& record) {
  const std::uint64_t size = field<std::uint32_t>(record.header, "size");
  chunk_ = ros::ByteReader(ros::decompress(codec_of(record.header), record.data, size, unpacked_));
  chunk_offset_ = record.offset;
}

void RosbagInput::add_connection(const Record& record) {
  const auto id = field<std::uint32_t>(record.header, "conn");
  if (channel_of_connection_.contains(id)) return;
  const std::string_view type = text_field(record.data, "type");
  channels_.push_back(
      {std::string(text_field(record.header, "topic")), ros::type_named(type), ros::Encoding::ros1, std::string(type)});
  channel_of_connection_[id] = channels_.size() - 1;
}

bool RosbagInput::next(ros::Message& message) {
  Record record;
  try {
    for (;;) {
      const bool chunked = next_in_chunk(record);
      if (!chunked && times_ && file_.offset() >= index_position_) return false;
      if (!chunked && !next_in_file(record)) {
        fail(record.offset, "the bag ends without an index: it is truncated or unfinished");
      }
      const Op op = op_of(record.header);
      if (op == Op::connection) add_connection(record);
      if (op == Op::chunk && !chunked) open_chunk(record);
      if (op != Op::message) continue;
      const auto channel = channel_of_connection_.find(field<std::uint32_t>(record.header, "conn"));
      if (channel == channel_of_connection_.end()) throw ros::Malformed("its topic is unknown");
      message = {channel->second, record.data, record.offset};
      return true;
    }
  } catch (const ros::Malformed& error) {
    fail(std::max(record.offset, chunk_offset_), std::string("a record cannot be read: ") + error.what());
  }
}

}  // namespace esim::inline formats::rosbag

#include "esim/formats/ros/mcap/mcap_input.h"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "esim/core/error.h"
#include "esim/formats/ros/chunk_codec.h"

namespace esim::inline formats::mcap {
namespace {

ros::ChunkCodec codec_named(std::string_view name) {
  if (name.empty()) return ros::ChunkCodec::none;
  if (name == "lz4") return ros::ChunkCodec::lz4;
  if (name == "zstd") return ros::ChunkCodec::zstd;
  throw ros::Malformed("the compression \"" + std::string(name) + "\" is neither lz4 nor zstd");
}

bool is_read(Op op) {
  return op == Op::schema || op == Op::channel || op == Op::message || op == Op::chunk || op == Op::statistics;
}

}  // namespace

McapInput::McapInput(std::filesystem::path path) : file_(std::move(path)) {
  file_.read_exactly(kMagic.size(), "its first bytes");
  const std::uint64_t start = file_.offset();
  read_summary();
  file_.seek(start);
}

/// If this fails, the file is read as one without a summary.
void McapInput::read_summary() {
  if (file_.size() < 2 * kMagic.size() + kFooterBytes) return;
  try {
    file_.seek(file_.size() - kMagic.size() - kFooterBytes);
    ros::ByteReader footer(file_.read_exactly(kFooterBytes + kMagic.size(), "the footer"));
    const auto op = footer.number<Op>();
    footer.number<std::uint64_t>();
    const auto start = footer.number<std::uint64_t>();
    if (op != Op::footer || start == 0) return;
    file_.seek(start);
    for (Record record = next_in_file(); record.op != Op::footer; record = next_in_file()) {
      if (record.op == Op::schema) add_schema(record.content);
      if (record.op == Op::channel) add_channel(record.content);
      if (record.op != Op::statistics) continue;
      ros::ByteReader statistics(record.content);
      statistics.take(8 + 2 + 4 + 4 + 4 + 4);  // counts
      const auto first = statistics.number<TimeNs>();
      times_ = TimeSpan{first, statistics.number<TimeNs>()};
    }
  } catch (const UserError&) {
    times_.reset();
  } catch (const ros::Malformed&) {
    times_.reset();
  }
}

McapInput::Record McapInput::next_in_file() {
  Record record{file_.offset()};
  ros::ByteReader head(file_.read_exactly(kRecordHeadBytes, "the header of a record"));
  record.op = head.number<Op>();
  const auto length = head.number<std::uint64_t>();
  if (length > file_.size() - file_.offset()) {
    fail(record.offset, "the file ends within a record whose stated length is " + std::to_string(length) + " bytes");
  }
  if (!is_read(record.op)) {
    file_.skip(length);
    return record;
  }
  if (length > ros::kMaxChunkBytes) {
    fail(record.offset, "a record is too long: " + std::to_string(length) + " bytes");
  }
  record.content = file_.read_exactly(static_cast<std::size_t>(length), "a record");
  return record;
}

McapInput::Record McapInput::next_in_chunk() {
  Record record{chunk_offset_};
  record.op = chunk_.number<Op>();
  record.content = chunk_.take(chunk_.number<std::uint64_t>());
  return record;
}

void McapInput::open_chunk(const Record& record) {
  ros::ByteReader content(record.content);
  content.take(2 * sizeof(std::uint64_t));  // times of the first and last message
  const auto size = content.number<std::uint64_t>();
  const auto crc = content.number<std::uint32_t>();
  const ros::ChunkCodec codec = codec_named(ros::as_text(content.counted()));
  const ros::Bytes packed = content.take(content.number<std::uint64_t>());
  const ros::Bytes raw = ros::decompress(codec, packed, size, unpacked_);
  if (crc != 0 && crc != crc32_z(0, reinterpret_cast<const unsigned char*>(raw.data()), raw.size())) {
    throw ros::Malformed("its checksum is wrong");
  }
  chunk_ = ros::ByteReader(raw);
  chunk_offset_ = record.offset;
}

void McapInput::add_schema(ros::Bytes content) {
  ros::ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  schemas_[id] = ros::as_text(reader.counted());
}

void McapInput::add_channel(ros::Bytes content) {
  ros::ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>(), schema = reader.number<std::uint16_t>();
  const std::string_view topic = ros::as_text(reader.counted()), encoding = ros::as_text(reader.counted());
  if (!channel_of_id_.try_emplace(id, channels_.size()).second) return;
  ros::Channel& channel = channels_.emplace_back();
  channel.topic = topic;
  channel.encoding = encoding == "ros1" ? ros::Encoding::ros1 : ros::Encoding::cdr;
  const auto name = schemas_.find(schema);
  if (name != schemas_.end()) channel.type_name = name->second;
  if (encoding == "ros1" || encoding == "cdr") {
    channel.type = ros::type_named(channel.type_name);
  } else {
    channel.type_name += (channel.type_name.empty() ? "in " : " in ") + std::string(encoding);
  }
}

bool McapInput::next(ros::Message& message) {
  Record record;
  try {
    while (!ended_) {
      const bool chunked = chunk_.left() > 0;
      record = chunked ? next_in_chunk() : next_in_file();
      if (record.op == Op::schema) add_schema(record.content);
      if (record.op == Op::channel) add_channel(record.content);
      if (record.op == Op::chunk && !chunked) open_chunk(record);
      ended_ = record.op == Op::data_end && !chunked;
      if (record.op != Op::message) continue;
      ros::ByteReader reader(record.content);
      const auto channel = channel_of_id_.find(reader.number<std::uint16_t>());
      if (channel == channel_of_id_.end()) throw ros::Malformed("its channel is unknown");
      reader.take(sizeof(std::uint32_t) + 2 * sizeof(std::uint64_t));  // number, times of recording and sending
      message = {channel->second, reader.take(reader.left()), record.offset};
      return true;
    }
    return false;
  } catch (const ros::Malformed& error) {
    fail(std::max(record.offset, chunk_offset_), std::string("a record cannot be read: ") + error.what());
  }
}

}  // namespace esim::inline formats::mcap

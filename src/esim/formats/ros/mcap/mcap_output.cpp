#include "esim/formats/ros/mcap/mcap_output.h"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "esim/formats/ros/mcap/mcap_records.h"

namespace esim::inline formats::mcap {
namespace {

constexpr std::size_t kChunkBytes = 1U << 20;

std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

/// Of bytes with the checksum `before`, followed by `size` bytes with the checksum `after`.
std::uint32_t joined_crc(std::uint32_t before, std::uint32_t after, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_combine(before, after, static_cast<z_off_t>(size)));
}

std::string_view name_of(ros::ChunkCodec codec) {
  if (codec == ros::ChunkCodec::zstd) return "zstd";
  return codec == ros::ChunkCodec::lz4 ? "lz4" : "";
}

}  // namespace

McapOutput::McapOutput(std::filesystem::path path, ros::ChunkCodec codec) : file_(std::move(path)), codec_(codec) {
  std::string start(kMagic);
  RecordWriter(start, Op::header).text("ros2").text("esim");
  append(start);
}

void McapOutput::append(std::string_view bytes) { append(bytes, crc_of(bytes)); }

void McapOutput::append(std::string_view bytes, std::uint32_t crc) {
  file_.append(bytes);
  position_ += bytes.size();
  data_crc_ = joined_crc(data_crc_, crc, bytes.size());
}

McapOutput::Channel& McapOutput::channel(const std::string& topic, ros::MessageType type) {
  const auto [entry, is_new] = channels_.try_emplace(topic);
  Channel& channel = entry->second;
  if (!is_new) return channel;
  channel.id = static_cast<std::uint16_t>(channels_.size() - 1);

  const auto [schema, new_schema] = schemas_.try_emplace(type, static_cast<std::uint16_t>(schemas_.size() + 1));
  if (new_schema) {
    const std::size_t at = schema_records_.size();
    RecordWriter(schema_records_, Op::schema)
        .number(schema->second)
        .text(ros::ros2_name_of(type))
        .text("ros2msg")
        .text(ros::definition_of(type, ros::Encoding::cdr));
    chunk_.append(schema_records_, at);
  }
  // The ROS 2 player looks up the quality of service; an empty one means its default.
  std::string metadata;
  for (const std::string_view text : {"offered_qos_profiles", ""}) {
    ros::append_number(metadata, static_cast<std::uint32_t>(text.size()));
    metadata += text;
  }
  const std::size_t at = channel_records_.size();
  RecordWriter(channel_records_, Op::channel)
      .number(channel.id)
      .number(schema->second)
      .text(topic)
      .text("cdr")
      .text(metadata);
  chunk_.append(channel_records_, at);
  return channel;
}

void McapOutput::write(const std::string& topic, ros::MessageType type, TimeNs t, std::string_view payload) {
  if (chunk_.empty()) chunk_start_ = chunk_end_ = t;
  chunk_start_ = std::min(chunk_start_, t), chunk_end_ = std::max(chunk_end_, t);
  Channel& channel = this->channel(topic, type);
  const auto time = static_cast<std::uint64_t>(t);
  channel.messages.emplace_back(time, chunk_.size());
  const auto sequence = static_cast<std::uint32_t>(channel.count++);
  RecordWriter(chunk_, Op::message).number(channel.id).number(sequence).number(time).number(time).bytes(payload);
  if (chunk_.size() >= kChunkBytes) flush_chunk();
}

void McapOutput::flush_chunk() {
  if (chunk_.empty()) return;
  const std::string_view packed = ros::compress(codec_, chunk_, packed_);
  ChunkIndex& index = chunks_.emplace_back(ChunkIndex{chunk_start_, chunk_end_, position_});
  index.packed_size = packed.size(), index.size = chunk_.size();
  const std::uint32_t crc = crc_of(chunk_);
  record_.clear();
  RecordWriter(record_, Op::chunk, packed.size())
      .number(chunk_start_)
      .number(chunk_end_)
      .number(index.size)
      .number(crc)
      .text(name_of(codec_))
      .number(index.packed_size);
  append(record_);
  append(packed, codec_ == ros::ChunkCodec::none ? crc : crc_of(packed));
  index.length = record_.size() + packed.size();

  for (auto& [topic, channel] : channels_) {
    if (channel.messages.empty()) continue;
    ros::append_number(index.message_indices, channel.id);
    ros::append_number(index.message_indices, position_);
    packed_.clear();
    for (const auto& [time, offset] : channel.messages) {
      ros::append_number(packed_, time);
      ros::append_number(packed_, offset);
    }
    record_.clear();
    RecordWriter(record_, Op::message_index).number(channel.id).text(packed_);
    append(record_);
    index.message_indices_length += record_.size();
    channel.messages.clear();
  }
  chunk_.clear();
}

/// Writes the summary, from its first record to the footer, which has the position of the summary.
std::string McapOutput::summary() const {
  std::string summary, offsets;
  const auto end_group = [&](Op op, std::size_t start) {
    if (summary.size() == start) return;
    RecordWriter(offsets, Op::summary_offset)
        .number(op)
        .number(position_ + start)
        .number(std::uint64_t{summary.size() - start});
  };
  std::size_t start = 0;
  summary += schema_records_;
  end_group(Op::schema, start);

  start = summary.size();
  summary += channel_records_;
  end_group(Op::channel, start);

  start = summary.size();
  TimeNs first = chunks_.empty() ? 0 : chunks_.front().start, last = 0;
  for (const ChunkIndex& chunk : chunks_) first = std::min(first, chunk.start), last = std::max(last, chunk.end);
  std::uint64_t messages = 0;
  std::string counts;
  for (const auto& [topic, channel] : channels_) {
    messages += channel.count;
    ros::append_number(counts, channel.id);
    ros::append_number(counts, channel.count);
  }
  RecordWriter(summary, Op::statistics)
      .number(messages)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(std::uint64_t{0})  // attachments and metadata
      .number(static_cast<std::uint32_t>(chunks_.size()))
      .number(first)
      .number(last)
      .text(counts);
  end_group(Op::statistics, start);

  start = summary.size();
  for (const ChunkIndex& chunk : chunks_) {
    RecordWriter(summary, Op::chunk_index)
        .number(chunk.start)
        .number(chunk.end)
        .number(chunk.position)
        .number(chunk.length)
        .text(chunk.message_indices)
        .number(chunk.message_indices_length)
        .text(name_of(codec_))
        .number(chunk.packed_size)
        .number(chunk.size);
  }
  end_group(Op::chunk_index, start);

  const std::uint64_t offsets_position = position_ + summary.size();
  summary += offsets;
  std::string footer;
  RecordWriter(footer, Op::footer).number(position_).number(offsets_position).number(std::uint32_t{0});
  // The checksum covers the footer before the checksum.
  footer.resize(footer.size() - sizeof(std::uint32_t));
  ros::append_number(footer, crc_of(summary + footer));
  return summary + footer;
}

void McapOutput::close() {
  flush_chunk();
  record_.clear();
  RecordWriter(record_, Op::data_end).number(data_crc_);
  append(record_);
  append(summary());
  append(kMagic);
  file_.close();
}

}  // namespace esim::inline formats::mcap

#include "esim/formats/ros/rosbag/rosbag_output.h"

#include <algorithm>
#include <utility>

#include "esim/formats/ros/rosbag/bag_records.h"

namespace esim::inline formats::rosbag {
namespace {

constexpr std::size_t kChunkBytes = 768 * 1024;  // as in ROS
constexpr std::size_t kBagHeaderBytes = 4096;    // with padding, so that it can be replaced
constexpr std::uint32_t kVersion = 1;            // of index records

void append_connection(std::string& out, std::uint32_t id, const std::string& topic, ros::MessageType type) {
  std::string data;
  append_field(data, "topic", topic);
  append_field(data, "type", ros::name_of(type));
  append_field(data, "md5sum", ros::md5_of(type));
  append_field(data, "message_definition", ros::definition_of(type, ros::Encoding::ros1));
  if (topic == "/tf_static") append_field(data, "latching", "1");
  RecordWriter(out, Op::connection).field("conn", id).text("topic", topic).end(data);
}

}  // namespace

RosbagOutput::RosbagOutput(std::filesystem::path path, ros::ChunkCodec codec) : file_(std::move(path)), codec_(codec) {
  append(kMagic);
  append(bag_header(0));
}

std::string RosbagOutput::bag_header(std::uint64_t index_position) const {
  std::string record;
  RecordWriter header(record, Op::bag_header);
  header.field("index_pos", index_position)
      .field("conn_count", static_cast<std::uint32_t>(connections_.size()))
      .field("chunk_count", static_cast<std::uint32_t>(chunks_.size()));
  header.end(std::string(kBagHeaderBytes - header.header_bytes(), ' '));
  return record;
}

void RosbagOutput::append(std::string_view bytes) {
  file_.append(bytes);
  position_ += bytes.size();
}

RosbagOutput::Connection& RosbagOutput::connection(const std::string& topic, ros::MessageType type) {
  const auto [entry, is_new] = connections_.try_emplace(topic);
  Connection& connection = entry->second;
  if (is_new) {
    connection.id = static_cast<std::uint32_t>(connections_.size() - 1);
    connection.type = type;
    append_connection(chunk_, connection.id, topic, type);
  }
  return connection;
}

void RosbagOutput::write(const std::string& topic, ros::MessageType type, TimeNs t, std::string_view payload) {
  if (chunk_.empty()) chunk_start_ = chunk_end_ = t;
  chunk_start_ = std::min(chunk_start_, t), chunk_end_ = std::max(chunk_end_, t);
  Connection& connection = this->connection(topic, type);
  connection.messages.emplace_back(to_ros(t), static_cast<std::uint32_t>(chunk_.size()));
  RecordWriter(chunk_, Op::message).field("conn", connection.id).field("time", to_ros(t)).end(payload);
  if (chunk_.size() >= kChunkBytes) flush_chunk();
}

void RosbagOutput::flush_chunk() {
  if (chunk_.empty()) return;
  ChunkInfo& info = chunks_.emplace_back(ChunkInfo{position_, chunk_start_, chunk_end_});
  const std::string_view packed = ros::compress(codec_, chunk_, packed_);
  record_.clear();
  RecordWriter(record_, Op::chunk)
      .text("compression", codec_ == ros::ChunkCodec::none ? "none" : "lz4")
      .field("size", static_cast<std::uint32_t>(chunk_.size()))
      .end_header(packed.size());
  append(record_);
  append(packed);

  for (auto& [topic, connection] : connections_) {
    if (connection.messages.empty()) continue;
    const auto count = static_cast<std::uint32_t>(connection.messages.size());
    info.counts.emplace_back(connection.id, count);
    record_.clear();
    RecordWriter(record_, Op::index)
        .field("ver", kVersion)
        .field("conn", connection.id)
        .field("count", count)
        .end_header(connection.messages.size() * (sizeof(std::uint64_t) + sizeof(std::uint32_t)));
    for (const auto& [time, offset] : connection.messages) {
      ros::append_number(record_, time);
      ros::append_number(record_, offset);
    }
    append(record_);
    connection.messages.clear();
  }
  chunk_.clear();
}

void RosbagOutput::close() {
  flush_chunk();
  const std::uint64_t index_position = position_;
  record_.clear();
  std::vector<std::pair<std::uint32_t, const std::string*>> in_order;
  for (const auto& [topic, connection] : connections_) in_order.emplace_back(connection.id, &topic);
  std::sort(in_order.begin(), in_order.end());
  for (const auto& [id, topic] : in_order) append_connection(record_, id, *topic, connections_.at(*topic).type);
  for (const ChunkInfo& info : chunks_) {
    RecordWriter(record_, Op::chunk_info)
        .field("ver", kVersion)
        .field("chunk_pos", info.position)
        .field("start_time", to_ros(info.start))
        .field("end_time", to_ros(info.end))
        .field("count", static_cast<std::uint32_t>(info.counts.size()))
        .end_header(info.counts.size() * 2 * sizeof(std::uint32_t));
    for (const auto& [connection, count] : info.counts) {
      ros::append_number(record_, connection);
      ros::append_number(record_, count);
    }
  }
  append(record_);
  file_.flush();
  file_.overwrite_start(std::string(kMagic) + bag_header(index_position));
  file_.close();
}

}  // namespace esim::inline formats::rosbag

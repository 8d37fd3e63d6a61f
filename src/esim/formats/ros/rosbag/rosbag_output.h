#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "esim/files/output_file.h"
#include "esim/formats/ros/chunk_codec.h"
#include "esim/formats/ros/message_file.h"

namespace esim::inline formats::rosbag {

/// Writes a bag: chunks with their indices, and at the end the index of chunks. Until close(), the header of the bag
/// states that there is no index.
class RosbagOutput final : public ros::MessageOutput {
 public:
  RosbagOutput(std::filesystem::path path, ros::ChunkCodec codec);

  void write(const std::string& topic, ros::MessageType type, TimeNs t, std::string_view payload) override;
  void close() override;

 private:
  struct Connection {
    std::uint32_t id = 0;
    ros::MessageType type{};
    std::vector<std::pair<std::uint64_t, std::uint32_t>> messages{};  // messages of the chunk: time, offset in it
  };

  struct ChunkInfo {
    std::uint64_t position = 0;
    TimeNs start = 0, end = 0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> counts{};  // connection and its number of messages
  };

  std::string bag_header(std::uint64_t index_position) const;
  Connection& connection(const std::string& topic, ros::MessageType type);
  void flush_chunk();
  void append(std::string_view bytes);

  OutputFile file_;
  ros::ChunkCodec codec_;
  std::uint64_t position_ = 0;  // in the file
  std::map<std::string, Connection> connections_;
  std::string chunk_, packed_, record_;
  TimeNs chunk_start_ = 0, chunk_end_ = 0;
  std::vector<ChunkInfo> chunks_;
};

}  // namespace esim::inline formats::rosbag

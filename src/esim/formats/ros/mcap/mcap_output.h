#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "esim/files/output_file.h"
#include "esim/formats/ros/chunk_codec.h"
#include "esim/formats/ros/message_file.h"

namespace esim::inline formats::mcap {

/// Writes an MCAP file with the profile "ros2": chunks with message indices, and a summary with schemas, channels,
/// statistics and chunk indices. Writes all checksums.
class McapOutput final : public ros::MessageOutput {
 public:
  McapOutput(std::filesystem::path path, ros::ChunkCodec codec);

  void write(const std::string& topic, ros::MessageType type, TimeNs t, std::string_view payload) override;
  void close() override;

 private:
  struct Channel {
    std::uint16_t id = 0;
    std::uint64_t count = 0;                                          // messages in the file
    std::vector<std::pair<std::uint64_t, std::uint64_t>> messages{};  // messages of the chunk: time, offset in it
  };

  struct ChunkIndex {
    TimeNs start = 0, end = 0;
    std::uint64_t position = 0, length = 0;
    std::string message_indices{};  // channel and position of its index, for each channel
    std::uint64_t message_indices_length = 0;
    std::uint64_t packed_size = 0, size = 0;
  };

  Channel& channel(const std::string& topic, ros::MessageType type);
  void flush_chunk();
  void append(std::string_view bytes);
  void append(std::string_view bytes, std::uint32_t crc);
  std::string summary() const;

  OutputFile file_;
  ros::ChunkCodec codec_;
  std::uint64_t position_ = 0;  // in the file
  std::uint32_t data_crc_ = 0;  // of the data written so far
  std::map<ros::MessageType, std::uint16_t> schemas_;
  std::map<std::string, Channel> channels_;
  std::string schema_records_, channel_records_;  // repeated in the summary
  std::string chunk_, packed_, record_;
  TimeNs chunk_start_ = 0, chunk_end_ = 0;
  std::vector<ChunkIndex> chunks_;
};

}  // namespace esim::inline formats::mcap

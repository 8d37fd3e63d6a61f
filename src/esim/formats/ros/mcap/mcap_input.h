#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "esim/files/input_file.h"
#include "esim/formats/ros/mcap/mcap_records.h"
#include "esim/formats/ros/message_file.h"

namespace esim::inline formats::mcap {

/// Reads MCAP files from start to end, chunk by chunk. The summary only lists the channels in advance. Reads messages
/// of ROS 1 and ROS 2; those of other encodings are skipped.
class McapInput final : public ros::MessageInput {
 public:
  explicit McapInput(std::filesystem::path path);

  const std::vector<ros::Channel>& channels() const override { return channels_; }
  std::optional<TimeSpan> times() const override { return times_; }
  bool next(ros::Message& message) override;
  double progress() const override { return file_.progress(); }
  [[noreturn]] void fail(std::uint64_t offset, std::string_view reason) const override { file_.fail(offset, reason); }

 private:
  struct Record {
    std::uint64_t offset = 0;
    Op op{};
    ros::Bytes content{};  // borrowed; empty for records that are not read
  };

  void read_summary();
  Record next_in_file();
  Record next_in_chunk();
  void open_chunk(const Record& record);
  void add_schema(ros::Bytes content);
  void add_channel(ros::Bytes content);

  InputFile file_;
  std::optional<TimeSpan> times_;
  bool ended_ = false;
  std::map<std::uint16_t, std::string> schemas_;  // their names
  std::vector<ros::Channel> channels_;
  std::map<std::uint16_t, std::size_t> channel_of_id_;
  std::vector<std::byte> unpacked_;
  ros::ByteReader chunk_{{}};
  std::uint64_t chunk_offset_ = 0;
};

}  // namespace esim::inline formats::mcap

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "esim/files/input_file.h"
#include "esim/formats/ros/message_file.h"
#include "esim/formats/ros/messages/bytes.h"

namespace esim::inline formats::rosbag {

/// Reads bags from start to end, chunk by chunk. The index only lists the topics in advance.
class RosbagInput final : public ros::MessageInput {
 public:
  explicit RosbagInput(std::filesystem::path path);

  const std::vector<ros::Channel>& channels() const override { return channels_; }
  std::optional<TimeSpan> times() const override { return times_; }
  bool next(ros::Message& message) override;
  double progress() const override { return file_.progress(); }
  [[noreturn]] void fail(std::uint64_t offset, std::string_view reason) const override { file_.fail(offset, reason); }

 private:
  struct Record {
    std::uint64_t offset = 0;
    std::span<const std::byte> header, data;  // borrowed
  };

  void read_bag_header();
  void read_index();
  bool next_in_file(Record& record);
  bool next_in_chunk(Record& record);
  void open_chunk(const Record& record);
  void add_connection(const Record& record);

  InputFile file_;
  std::uint64_t index_position_ = 0;  // 0: no index
  std::optional<TimeSpan> times_;
  std::vector<ros::Channel> channels_;
  std::map<std::uint32_t, std::size_t> channel_of_connection_;
  std::string header_;  // header of the current record
  std::vector<std::byte> unpacked_;
  ros::ByteReader chunk_{{}};
  std::uint64_t chunk_offset_ = 0;
};

}  // namespace esim::inline formats::rosbag

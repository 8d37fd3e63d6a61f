#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "esim/formats/ros/message_file.h"
#include "esim/formats/ros/rosbag2/sqlite_file.h"

namespace esim::inline formats::rosbag2 {

/// Reads an SQLite file of a ROS 2 bag, in the order in which messages were recorded. The offset of a message is its
/// number.
class SqliteInput final : public ros::MessageInput {
 public:
  explicit SqliteInput(std::filesystem::path path);

  const std::vector<ros::Channel>& channels() const override { return channels_; }
  std::optional<TimeSpan> times() const override { return times_; }
  bool next(ros::Message& message) override;
  double progress() const override;
  [[noreturn]] void fail(std::uint64_t offset, std::string_view reason) const override;

 private:
  [[noreturn]] void fail(std::string_view reason) const;
  void check_size();
  void read_topics();

  std::filesystem::path path_;
  std::optional<SqliteFile> file_;
  std::vector<ros::Channel> channels_;
  std::map<std::int64_t, std::size_t> channel_of_id_;
  std::optional<TimeSpan> times_;
  std::optional<SqliteStatement> messages_;  // destroyed before the file
  std::uint64_t done_ = 0, count_ = 0;
};

}  // namespace esim::inline formats::rosbag2

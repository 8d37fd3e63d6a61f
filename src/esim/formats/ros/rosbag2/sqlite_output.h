#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "esim/formats/ros/message_file.h"
#include "esim/formats/ros/rosbag2/bag_folder.h"
#include "esim/formats/ros/rosbag2/sqlite_file.h"

namespace esim::inline formats::rosbag2 {

/// Writes a ROS 2 bag: a folder with an SQLite file and metadata.yaml. An existing one is replaced.
class SqliteOutput final : public ros::MessageOutput {
 public:
  explicit SqliteOutput(std::filesystem::path folder);

  void write(const std::string& topic, ros::MessageType type, TimeNs t, std::string_view payload) override;
  void close() override;

 private:
  [[noreturn]] void fail(const std::string& reason) const;
  std::size_t topic(const std::string& name, ros::MessageType type);

  std::filesystem::path folder_;
  std::optional<SqliteFile> file_;
  std::optional<SqliteStatement> insert_;  // destroyed before the file
  std::vector<Topic> topics_;
  std::map<std::string, std::size_t> topic_of_name_;
  TimeNs first_ = 0, last_ = 0;
  std::size_t uncommitted_bytes_ = 0;
};

}  // namespace esim::inline formats::rosbag2

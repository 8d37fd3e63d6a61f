#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "esim/formats/ros/message_file.h"

namespace esim::inline formats::rosbag2 {

/// Reads the files of a ROS 2 bag, SQLite or MCAP, one after another. Messages may have been compressed one by one.
class BagInput final : public ros::MessageInput {
 public:
  explicit BagInput(const std::vector<std::filesystem::path>& files);

  const std::vector<ros::Channel>& channels() const override { return channels_; }
  std::optional<TimeSpan> times() const override;
  bool next(ros::Message& message) override;
  double progress() const override;
  [[noreturn]] void fail(std::uint64_t offset, std::string_view reason) const override;

 private:
  struct File {
    std::unique_ptr<ros::MessageInput> input;
    std::vector<std::size_t> channels{};  // their indices in the bag
  };

  std::size_t channel_of(File& file, std::size_t channel);

  std::vector<File> files_;
  std::vector<ros::Channel> channels_;
  std::size_t current_ = 0;
  std::vector<std::byte> unpacked_;
};

}  // namespace esim::inline formats::rosbag2

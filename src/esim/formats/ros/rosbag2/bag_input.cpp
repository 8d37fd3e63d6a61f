#include "esim/formats/ros/rosbag2/bag_input.h"

#include <algorithm>

#include "esim/core/error.h"
#include "esim/files/codecs/zstandard.h"
#include "esim/formats/ros/chunk_codec.h"
#include "esim/formats/ros/mcap/mcap_input.h"
#include "esim/formats/ros/rosbag2/sqlite_input.h"

namespace esim::inline formats::rosbag2 {

namespace {

constexpr std::string_view kZstandardMagic = "\x28\xb5\x2f\xfd";  // CDR begins with 0

}  // namespace

BagInput::BagInput(const std::vector<std::filesystem::path>& files) {
  for (const std::filesystem::path& path : files) {
    File& file = files_.emplace_back();
    if (path.extension() == ".mcap") {
      file.input = std::make_unique<mcap::McapInput>(path);
    } else {
      file.input = std::make_unique<SqliteInput>(path);
    }
    for (std::size_t i = 0; i < file.input->channels().size(); ++i) channel_of(file, i);
  }
}

/// The index in the bag of a channel of a file, which the file may have found just now.
std::size_t BagInput::channel_of(File& file, std::size_t channel) {
  while (file.channels.size() <= channel) {
    const ros::Channel& added = file.input->channels()[file.channels.size()];
    const auto known = std::ranges::find_if(channels_, [&](const ros::Channel& other) {
      return other.topic == added.topic && other.type_name == added.type_name && other.encoding == added.encoding;
    });
    file.channels.push_back(static_cast<std::size_t>(known - channels_.begin()));
    if (known == channels_.end()) channels_.push_back(added);
  }
  return file.channels[channel];
}

std::optional<TimeSpan> BagInput::times() const {
  std::optional<TimeSpan> all;
  for (const File& file : files_) {
    const std::optional<TimeSpan> times = file.input->times();
    if (!times) return {};
    all = all ? TimeSpan{std::min(all->start, times->start), std::max(all->end, times->end)} : *times;
  }
  return all;
}

bool BagInput::next(ros::Message& message) {
  for (; current_ < files_.size(); ++current_) {
    File& file = files_[current_];
    if (!file.input->next(message)) continue;
    message.channel = channel_of(file, message.channel);
    const std::string_view packed{reinterpret_cast<const char*>(message.payload.data()), message.payload.size()};
    if (!packed.starts_with(kZstandardMagic)) return true;
    try {
      message.payload =
          ros::decompress(ros::ChunkCodec::zstd, message.payload, zstandard_content_size(packed), unpacked_);
      return true;
    } catch (const ros::Malformed& error) {
      fail(message.offset, error.what());
    }
  }
  return false;
}

double BagInput::progress() const {
  const double done = current_ < files_.size() ? files_[current_].input->progress() : 0;
  return (static_cast<double>(current_) + done) / static_cast<double>(files_.size());
}

void BagInput::fail(std::uint64_t offset, std::string_view reason) const {
  files_[std::min(current_, files_.size() - 1)].input->fail(offset, reason);
  throw InternalError("fail() has returned");  // GCC overlooks that this virtual function does not
}

}  // namespace esim::inline formats::rosbag2

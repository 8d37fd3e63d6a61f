#include "esim/formats/ros/rosbag2/sqlite_input.h"

#include <fmt/format.h>

#include <utility>

#include "esim/core/error.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline formats::rosbag2 {

SqliteInput::SqliteInput(std::filesystem::path path) : path_(std::move(path)) {
  require_existing(path_);
  try {
    file_.emplace(path_, SqliteFile::Access::read);
    check_size();
    read_topics();
    SqliteStatement span(*file_, "SELECT count(*), min(timestamp), max(timestamp) FROM messages");
    if (span.step()) {
      count_ = static_cast<std::uint64_t>(span.integer(0));
      if (count_ > 0) times_ = TimeSpan{span.integer(1), span.integer(2)};
    }
    messages_.emplace(*file_, "SELECT id, topic_id, data FROM messages ORDER BY id");
  } catch (const SqliteError& error) {
    fail(error.reason);
  }
}

/// SQLite reads zeros after the end of a file.
void SqliteInput::check_size() {
  SqliteStatement size(*file_, "SELECT page_count * page_size FROM pragma_page_count(), pragma_page_size()");
  const std::int64_t expected = size.step() ? size.integer(0) : 0;
  const auto there = static_cast<std::int64_t>(std::filesystem::file_size(path_));
  if (there < expected) fail(fmt::format("the file was truncated: it has {} of {} bytes", there, expected));
}

void SqliteInput::read_topics() {
  // Views could run for ever.
  SqliteStatement tables(*file_,
                         "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('messages', 'topics')");
  if (!tables.step() || tables.integer(0) != 2)
    fail("it is not a ROS 2 bag: the tables \"topics\" and \"messages\" are missing");
  SqliteStatement topics(*file_, "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  while (topics.step()) {
    channel_of_id_.emplace(topics.integer(0), channels_.size());
    ros::Channel& channel = channels_.emplace_back();
    channel.topic = topics.text(1);
    channel.type_name = topics.text(2);
    channel.encoding = ros::Encoding::cdr;
    const std::string format = topics.text(3);
    if (format == "cdr") {
      channel.type = ros::type_named(channel.type_name);
    } else {
      channel.type_name += " in " + format;
    }
  }
}

bool SqliteInput::next(ros::Message& message) {
  try {
    if (!messages_ || !messages_->step()) {
      messages_.reset();
      return false;
    }
    message.offset = static_cast<std::uint64_t>(messages_->integer(0));
    const auto channel = channel_of_id_.find(messages_->integer(1));
    if (channel == channel_of_id_.end()) fail(message.offset, "its topic is unknown");
    message.channel = channel->second;
    message.payload = messages_->blob(2);
    ++done_;
  } catch (const SqliteError& error) {
    messages_.reset();
    fail(error.reason);
  }
  return true;
}

double SqliteInput::progress() const {
  return count_ > 0 ? static_cast<double>(done_) / static_cast<double>(count_) : 1;
}

void SqliteInput::fail(std::string_view reason) const {
  throw UserError(fmt::format("cannot read {}: {}", path_.string(), reason));
}

void SqliteInput::fail(std::uint64_t offset, std::string_view reason) const {
  throw UserError(fmt::format("cannot read {}: message {}: {}", path_.string(), offset, reason));
}

}  // namespace esim::inline formats::rosbag2

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/time.h"
#include "esim/formats/ros/messages/message_types.h"

namespace esim::inline formats::ros {

/// Writes a file of messages with times, on topics. Every failure is an OutputError that names the file.
class MessageOutput {
 public:
  virtual ~MessageOutput() = default;

  virtual void write(const std::string& topic, MessageType type, TimeNs t, std::string_view payload) = 0;

  /// Writes the index and makes everything durable.
  virtual void close() = 0;
};

/// The messages of one type on one topic.
struct Channel {
  std::string topic{};
  std::optional<MessageType> type{};  ///< nothing: an unsupported type
  Encoding encoding = Encoding::ros1;
  std::string type_name{};  ///< as in the file
};

struct Message {
  std::size_t channel = 0;   ///< index into channels()
  Bytes payload{};           ///< borrowed until the next message
  std::uint64_t offset = 0;  ///< position in the file of the message or of its chunk
};

/// Reads a file of messages, in the order of the file. Fails like InputFile: "cannot read FILE: at byte N: REASON".
class MessageInput {
 public:
  virtual ~MessageInput() = default;

  /// The channels in the file's index, if there is one; otherwise those up to the last message read.
  virtual const std::vector<Channel>& channels() const = 0;

  /// The times of the first and last message by the writer's clock, which may differ from their stamps; nothing if the
  /// file has no index: it was truncated, or its writer was killed.
  virtual std::optional<TimeSpan> times() const = 0;

  /// Returns false at the end. Throws UserError if the file is damaged, and at the end if it is incomplete.
  virtual bool next(Message& message) = 0;

  virtual double progress() const = 0;
  [[noreturn]] virtual void fail(std::uint64_t offset, std::string_view reason) const = 0;
};

}  // namespace esim::inline formats::ros

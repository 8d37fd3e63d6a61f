#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/time.h"
#include "esim/record/formats/ros/message_types.h"

namespace esim::ros {

/// A file of messages with times, on topics, being written. Every failure is an OutputError with the file's name.
class MessageOutput {
 public:
  virtual ~MessageOutput() = default;

  virtual void write(const std::string& topic, MessageType type, TimeNs t, std::string_view payload) = 0;

  /// Writes what readers find their way by, and makes everything durable.
  virtual void close() = 0;
};

/// The messages of one type on one topic.
struct Channel {
  std::string topic{};
  std::optional<MessageType> type{};  ///< nothing: one that is not read
  Encoding encoding = Encoding::ros1;
  std::string type_name{};  ///< as the file has it
};

struct Message {
  std::size_t channel = 0;   ///< index into channels()
  Bytes payload{};           ///< borrowed until the next message
  std::uint64_t offset = 0;  ///< in the file, of the message or of the chunk that holds it
};

/// A file of messages being read, in its order. Fails like InputFile: "cannot read FILE: at byte N: REASON".
class MessageInput {
 public:
  virtual ~MessageInput() = default;

  /// Those in the file's index, where there is one; otherwise those up to the message read last.
  virtual const std::vector<Channel>& channels() const = 0;

  /// When the first and the last message were written, by the writer's clock, which need not be that of their stamps;
  /// nothing where the file has no index: it was cut, or its writer was killed.
  virtual std::optional<TimeSpan> times() const = 0;

  /// False at the end. Throws UserError where the file is damaged, and at the end of one that is not whole.
  virtual bool next(Message& message) = 0;

  virtual double progress() const = 0;
  [[noreturn]] virtual void fail(std::uint64_t offset, std::string_view reason) const = 0;
};

}  // namespace esim::ros

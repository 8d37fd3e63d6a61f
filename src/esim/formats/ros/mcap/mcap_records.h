#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "esim/formats/ros/messages/bytes.h"

namespace esim::inline formats::mcap {

// MCAP: a magic number, records (opcode, length as 64 bits, content), and the magic number again. Texts and lists are
// preceded by their length in bytes as 32 bits.

inline constexpr std::string_view kMagic = "\x89MCAP0\r\n";

enum class Op : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  summary_offset = 14,
  data_end = 15,
};

inline constexpr std::size_t kRecordHeadBytes = 9;
inline constexpr std::size_t kFooterBytes = kRecordHeadBytes + 20;

/// Appends a record to `out`; its content ends when this object is destroyed, but for the `rest`: so many bytes, which
/// the caller writes behind it.
class RecordWriter {
 public:
  RecordWriter(std::string& out, Op op, std::uint64_t rest = 0) : out_(out), rest_(rest) {
    ros::append_number(out_, op);
    ros::append_number(out_, std::uint64_t{0});
    start_ = out_.size();
  }
  ~RecordWriter() { ros::store(out_.data() + start_ - sizeof(std::uint64_t), out_.size() - start_ + rest_); }
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;

  template <typename T>
  RecordWriter& number(T value) {
    ros::append_number(out_, value);
    return *this;
  }
  RecordWriter& text(std::string_view value) {
    ros::append_number(out_, static_cast<std::uint32_t>(value.size()));
    return bytes(value);
  }
  RecordWriter& bytes(std::string_view value) {
    out_ += value;
    return *this;
  }

 private:
  std::string& out_;
  std::uint64_t rest_;
  std::size_t start_ = 0;
};

}  // namespace esim::inline formats::mcap

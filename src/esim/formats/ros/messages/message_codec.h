#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/formats/ros/messages/bytes.h"

namespace esim::inline formats::ros {

/// The encoding of messages as bytes.
enum class Encoding {
  ros1,  ///< ROS 1: packed
  cdr,   ///< ROS 2, CDR: numbers aligned to their size, counted from after the first four bytes, which are the
         ///< encoding
};

/// A sequence of bytes in a message, borrowed.
using Bytes = std::span<const std::byte>;

/// A sequence of float32 in a message, borrowed.
struct Floats {
  Bytes bytes;
};

inline constexpr std::size_t kCdrHeaderBytes = 4;

/// Appends the values of a message. Messages list their fields in `fields()`, see messages.h.
class MessageWriter {
 public:
  /// Replaces the content of `out`.
  MessageWriter(Encoding encoding, std::string& out) : encoding_(encoding), out_(out) {
    out_.clear();
    if (encoding == Encoding::cdr) out_.append("\0\1\0\0", kCdrHeaderBytes);
  }

  template <typename... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }

  /// Must be from 0 to the largest second of the encoding: 2^32 - 1, or 2^31 - 1 in ROS 2.
  void time(TimeNs t) {
    number(static_cast<std::uint32_t>(t / kNsPerSecond));
    number(static_cast<std::uint32_t>(t % kNsPerSecond));
  }

  /// Headers of ROS 1 start with a sequence number.
  void sequence_number() {
    if (encoding_ == Encoding::ros1) number(std::uint32_t{0});
  }

  /// Room for so many bytes, zero until the caller writes them, before the next call.
  char* append(std::size_t count) {
    const std::size_t at = out_.size();
    out_.resize(at + count);
    return out_.data() + at;
  }

  void count(std::size_t elements) { number(static_cast<std::uint32_t>(elements)); }
  Encoding encoding() const { return encoding_; }

 private:
  template <typename T>
  void number(T value) {
    if (encoding_ == Encoding::cdr) append((0 - (out_.size() - kCdrHeaderBytes)) % sizeof value);
    append_number(out_, value);
  }

  template <typename T>
  void put(const T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      number(value);
    } else {
      T::fields(value, *this);
    }
  }

  void put(const std::string& text) {
    const bool terminated = encoding_ == Encoding::cdr;
    count(text.size() + (terminated ? 1 : 0));
    out_.append(text.c_str(), text.size() + (terminated ? 1 : 0));
  }

  void put(const Bytes& bytes) {
    count(bytes.size());
    out_.append(as_text(bytes));
  }

  void put(const Floats& floats) {
    count(floats.bytes.size() / sizeof(float));
    out_.append(as_text(floats.bytes));
  }

  void put(const Eigen::Vector3d& v) { (*this)(v.x(), v.y(), v.z()); }
  void put(const Eigen::Quaterniond& q) { (*this)(q.x(), q.y(), q.z(), q.w()); }

  template <typename T, std::size_t N>
  void put(const std::array<T, N>& values) {
    for (const T& value : values) put(value);
  }

  template <typename T>
  void put(const std::vector<T>& values) {
    count(values.size());
    for (const T& value : values) put(value);
  }

  Encoding encoding_;
  std::string& out_;
};

/// Reads the messages of MessageWriter. Throws Malformed if there are too few bytes.
class MessageReader {
 public:
  MessageReader(Encoding encoding, std::span<const std::byte> payload) : encoding_(encoding), bytes_(payload) {
    if (encoding != Encoding::cdr) return;
    const auto header = bytes_.take(kCdrHeaderBytes);
    if (header[0] != std::byte{0} || header[1] != std::byte{1})
      throw Malformed("its encoding is not little-endian CDR");
  }

  template <typename... T>
  void operator()(T&... values) {
    (get(values), ...);
  }

  void time(TimeNs& t) {
    const auto seconds = number<std::uint32_t>();
    const auto nanoseconds = number<std::uint32_t>();
    t = (encoding_ == Encoding::cdr ? TimeNs{static_cast<std::int32_t>(seconds)} : TimeNs{seconds}) * kNsPerSecond +
        nanoseconds;
  }

  void sequence_number() {
    if (encoding_ == Encoding::ros1) number<std::uint32_t>();
  }

  std::span<const std::byte> take(std::uint64_t count) { return bytes_.take(count); }
  std::uint32_t count() { return number<std::uint32_t>(); }
  Encoding encoding() const { return encoding_; }

 private:
  template <typename T>
  T number() {
    if (encoding_ == Encoding::cdr) bytes_.take((0 - (bytes_.position() - kCdrHeaderBytes)) % sizeof(T));
    return bytes_.number<T>();
  }

  template <typename T>
  void get(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      value = number<T>();
    } else {
      T::fields(value, *this);
    }
  }

  void get(std::string& text) {
    text = as_text(take(count()));
    if (encoding_ == Encoding::cdr && text.ends_with('\0')) text.pop_back();
  }

  void get(Bytes& bytes) { bytes = take(count()); }
  void get(Floats& floats) { floats.bytes = take(std::uint64_t{count()} * sizeof(float)); }
  void get(Eigen::Vector3d& v) { (*this)(v.x(), v.y(), v.z()); }
  void get(Eigen::Quaterniond& q) { (*this)(q.x(), q.y(), q.z(), q.w()); }

  template <typename T, std::size_t N>
  void get(std::array<T, N>& values) {
    for (T& value : values) get(value);
  }

  // Grows with the data present, not with the stated count.
  template <typename T>
  void get(std::vector<T>& values) {
    values.clear();
    for (std::uint32_t left = count(); left > 0; --left) get(values.emplace_back());
  }

  Encoding encoding_;
  ByteReader bytes_;
};

}  // namespace esim::inline formats::ros

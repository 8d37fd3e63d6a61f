#pragma once

#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace esim {

using SteadyTime = std::chrono::steady_clock::time_point;

SteadyTime seconds_from_now(double seconds);

/// The other side has gone away; it may come back.
class ConnectionLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The other side does not want us; it may later.
class ConnectionRefused : public ConnectionLost {
 public:
  using ConnectionLost::ConnectionLost;
};

/// What comes is not what the protocol says; the message is the end of a sentence about the server.
class ProtocolError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Messages over TCP, as UnrealCV frames them: a magic number and the payload's size, 32 bits each, little-endian, then
/// the payload. Nothing here blocks beyond the deadline that it is given.
class MessageConnection {
 public:
  /// Throws ConnectionRefused where nobody listens there, or there is no such host.
  MessageConnection(const std::string& host, int port, SteadyTime deadline);
  ~MessageConnection();
  MessageConnection(const MessageConnection&) = delete;
  MessageConnection& operator=(const MessageConnection&) = delete;

  /// Hands over a message; what the socket does not take at once is sent while waiting for answers. Throws
  /// ConnectionLost.
  void send(std::string_view payload);

  /// The next message, of at most `most_bytes`; false where none has come by the deadline. Throws ConnectionLost, and
  /// ProtocolError for what is no such message.
  bool receive(std::string& payload, std::size_t most_bytes, SteadyTime deadline);

 private:
  void write_some();
  bool read_into(char* to, std::size_t size, std::size_t& have, SteadyTime deadline);

  int socket_ = -1;
  std::string unsent_;

  // Of the message that is coming in.
  std::string incoming_;
  std::size_t have_ = 0;
  char header_[8] = {};
  std::size_t have_header_ = 0;
};

}  // namespace esim

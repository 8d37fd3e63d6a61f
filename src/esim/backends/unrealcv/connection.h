#pragma once

#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

// Private to backends/unrealcv.
namespace esim::inline backends::inline unrealcv {

using SteadyTime = std::chrono::steady_clock::time_point;

SteadyTime seconds_from_now(double seconds);

/// The connection was closed; the server may come back.
class ConnectionLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The server refused the connection; it may accept later.
class ConnectionRefused : public ConnectionLost {
 public:
  using ConnectionLost::ConnectionLost;
};

/// The server violated the protocol; the message is the end of a sentence about the server.
class ProtocolError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Messages over TCP, as UnrealCV frames them: a magic number and the payload's size, 32 bits each, little-endian, then
/// the payload. No function blocks beyond its deadline.
class MessageConnection {
 public:
  /// Throws ConnectionRefused if no server listens there, or if the host does not exist.
  MessageConnection(const std::string& host, int port, SteadyTime deadline);
  ~MessageConnection();
  MessageConnection(const MessageConnection&) = delete;
  MessageConnection& operator=(const MessageConnection&) = delete;

  /// Sends a message; the part that the socket does not accept immediately is sent while waiting for answers. Throws
  /// ConnectionLost.
  void send(std::string_view payload);

  /// Receives the next message, of at most `max_bytes`; false if it is not complete by the deadline. Throws
  /// ConnectionLost, and ProtocolError for an invalid message.
  bool receive(std::string& payload, std::size_t max_bytes, SteadyTime deadline);

 private:
  void write_some();
  bool read_into(char* to, std::size_t size, std::size_t& have, SteadyTime deadline);

  int socket_ = -1;
  std::string unsent_;

  // The message that is being received.
  std::string incoming_;
  std::size_t have_ = 0;
  char header_[8] = {};
  std::size_t have_header_ = 0;
};

}  // namespace esim::inline backends::inline unrealcv

#include "esim/backends/unrealcv/connection.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <utility>

namespace esim::inline backends::inline unrealcv {
namespace {

constexpr std::uint32_t kMagic = 0x9E2B83C1;
constexpr std::size_t kPortion = std::size_t{1} << 20;  // step of allocation while a message is received

std::uint32_t number_at(const char* bytes) {
  std::uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8 | static_cast<unsigned char>(bytes[i]);
  return number;
}

void append_number(std::string& bytes, std::uint32_t number) {
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(number >> 8 * i & 0xFF);
}

int milliseconds_until(SteadyTime deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 1 << 30));
}

/// Waits for an event; false at the deadline.
bool wait_for(int socket, short events, SteadyTime deadline, short* happened = nullptr) {
  while (true) {
    pollfd poll_for{socket, events, 0};
    const int count = ::poll(&poll_for, 1, milliseconds_until(deadline));
    if (count > 0) {
      if (happened != nullptr) *happened = poll_for.revents;
      return true;
    }
    if (count < 0 && errno != EINTR) throw ConnectionLost(std::strerror(errno));
    if (count == 0 && std::chrono::steady_clock::now() >= deadline) return false;
  }
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

/// Connects to one of a host's addresses; returns the reason if it fails.
std::string connect_to(const addrinfo& address, SteadyTime deadline, int& socket) {
  socket = ::socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, address.ai_protocol);
  if (socket < 0) return std::strerror(errno);
  int error = 0;
  if (::connect(socket, address.ai_addr, address.ai_addrlen) != 0) error = errno;
  if (error == EINPROGRESS) {
    if (!wait_for(socket, POLLOUT, deadline)) return "no answer";
    socklen_t size = sizeof error;
    ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  return error != 0 ? std::strerror(error) : "";
}

}  // namespace

SteadyTime seconds_from_now(double seconds) {
  using Clock = std::chrono::steady_clock;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

MessageConnection::MessageConnection(const std::string& host, int port, SteadyTime deadline) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int failure = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list);
  if (failure != 0) throw ConnectionRefused(std::string("no such host: ") + ::gai_strerror(failure));
  const std::unique_ptr<addrinfo, FreeAddresses> addresses(list);
  std::string problem;
  for (const addrinfo* address = list; address != nullptr; address = address->ai_next) {
    problem = connect_to(*address, deadline, socket_);
    if (problem.empty()) break;
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }
  if (!problem.empty()) throw ConnectionRefused(problem);
  const int on = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

MessageConnection::~MessageConnection() {
  if (socket_ >= 0) ::close(socket_);
}

void MessageConnection::send(std::string_view payload) {
  append_number(unsent_, kMagic);
  append_number(unsent_, static_cast<std::uint32_t>(payload.size()));
  unsent_ += payload;
  write_some();
}

void MessageConnection::write_some() {
  while (!unsent_.empty()) {
    const ssize_t count = ::send(socket_, unsent_.data(), unsent_.size(), MSG_NOSIGNAL);
    if (count < 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) return;
      throw ConnectionLost(std::strerror(errno));
    }
    unsent_.erase(0, static_cast<std::size_t>(count));
  }
}

/// Reads until `have` is `size`; false at the deadline. Meanwhile sends waiting data.
bool MessageConnection::read_into(char* to, std::size_t size, std::size_t& have, SteadyTime deadline) {
  while (have < size) {
    const ssize_t count = ::recv(socket_, to + have, size - have, 0);
    if (count > 0) {
      have += static_cast<std::size_t>(count);
      continue;
    }
    if (count == 0) throw ConnectionLost("the connection was closed");
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) throw ConnectionLost(std::strerror(errno));
    short happened = 0;
    const auto events = static_cast<short>(unsent_.empty() ? POLLIN : POLLIN | POLLOUT);
    if (!wait_for(socket_, events, deadline, &happened)) return false;
    if ((happened & POLLOUT) != 0) write_some();
  }
  return true;
}

bool MessageConnection::receive(std::string& payload, std::size_t max_bytes, SteadyTime deadline) {
  if (!read_into(header_, sizeof header_, have_header_, deadline)) return false;
  if (number_at(header_) != kMagic)
    throw ProtocolError("sent a message with a wrong magic number, which is not UnrealCV's protocol");
  const std::size_t size = number_at(header_ + 4);
  if (size > max_bytes)
    throw ProtocolError("announced a message of " + std::to_string(size) + " bytes, more than any answer can have");
  while (have_ < size) {
    incoming_.resize(std::min(size, have_ + kPortion));
    if (!read_into(incoming_.data(), incoming_.size(), have_, deadline)) return false;
  }
  incoming_.resize(size);
  std::swap(payload, incoming_);
  have_ = have_header_ = 0;
  return true;
}

}  // namespace esim::inline backends::inline unrealcv

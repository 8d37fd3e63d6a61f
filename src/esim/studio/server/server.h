#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "esim/studio/server/http.h"

namespace esim::studio {

/// Limits of connections.
struct ServerLimits {
  std::size_t head_bytes = std::size_t{16} << 10;
  std::size_t body_bytes = std::size_t{8} << 20;
  int connections = 64;                         ///< further ones are closed at once
  std::chrono::milliseconds head_time{15'000};  ///< from the connection or the last answer to the end of the headers
  std::chrono::milliseconds body_time{30'000};
  std::chrono::milliseconds write_time{60'000};
};

/// An HTTP/1.1 server.
class HttpServer {
 public:
  /// Sees the head of a request before its body is read; a returned answer ends the request. Must not block.
  using Admit = std::function<std::optional<Response>(const RequestHead&)>;

  /// Answers a request, on one of a few threads. Must not throw.
  using Handle = std::function<Response(const Request&)>;

  /// The address to listen on, at the first free one of `ports`. Throws UserError if none is free.
  struct Place {
    std::string host = "127.0.0.1";
    int port = 0;  ///< 0: any free port
    int ports = 1;
  };

  explicit HttpServer(const Place& place, const ServerLimits& limits = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const;

  /// Starts answering. Call once.
  void start(Admit admit, Handle handle);

  /// Ends all connections, and returns when all handlers have finished.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::studio

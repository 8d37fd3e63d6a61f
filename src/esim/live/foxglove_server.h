#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "esim/live/publication.h"

namespace esim::inline live {

/// A value that clients can read and, perhaps, set.
struct Parameter {
  std::string name{};
  std::variant<bool, double> value{};
};

/// A WebSocket server of Foxglove's protocol, versions "foxglove.websocket.v1" and "foxglove.sdk.v1"
/// (github.com/foxglove/ws-protocol), for Foxglove, Lichtblick, PlotJuggler and programs. Clients that read too slowly
/// lose messages, and are told how many; the server never waits for them.
class FoxgloveServer final : public Publication {
 public:
  struct Place {
    std::string host = "127.0.0.1";
    int port = 8765;  ///< 0: any free port
  };
  struct Limits {
    std::size_t queue_bytes = std::size_t{64} << 20;  ///< per client; messages beyond are dropped
    int clients = 32;                                 ///< further ones are refused
  };

  /// They are called on the server's thread, and must not throw.
  struct Handlers {
    std::function<void(const ClientMessage&)> message{};
    std::function<std::vector<Parameter>()> parameters{};  ///< all of them, with their values
    std::function<std::string(const Parameter&)> set{};    ///< sets a parameter; returns the problem, or nothing
  };

  /// Throws UserError if the address cannot be listened on.
  FoxgloveServer(const Place& place, const Limits& limits, Handlers handlers);
  ~FoxgloveServer() override;
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  int port() const;

  std::uint32_t advertise(Channel channel) override;
  void publish(std::uint32_t channel, TimeNs t, std::string_view payload) override;
  void publish_time(TimeNs t) override;
  std::int64_t dropped() const override;

  /// Sends the parameters to the clients that asked for changes.
  void send_parameters();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline live

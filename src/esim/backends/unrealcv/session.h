#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/backends/unrealcv/connection.h"
#include "esim/backends/unrealcv/unrealcv_options.h"

// Private to backends/unrealcv.
namespace esim::inline backends::inline unrealcv {

/// Throws EngineError: "unrealcv 127.0.0.1:9000: PROBLEM; REMEDY".
[[noreturn]] void fail(const UnrealcvOptions& options, const std::string& problem, const std::string& remedy);

/// A command of UnrealCV, and its answer.
struct EngineRequest {
  std::string command;
  std::optional<std::string> answer{};

  bool is_refused() const { return answer && answer->starts_with("error"); }
};

using EngineBatch = std::vector<EngineRequest>;

/// One connection to an UnrealCV server: requests are sent with ids, by which answers are assigned to them. It cannot
/// be used after an exception.
class EngineSession {
 public:
  /// Connects, and waits for the greeting. Throws ConnectionRefused if no server listens, and ConnectionLost if the
  /// server closes the connection, as it does while it has another client.
  EngineSession(const UnrealcvOptions& options, SteadyTime deadline);

  /// Allows answers of up to this number of bytes.
  void expect_up_to(std::size_t bytes) { max_bytes_ = std::max(max_bytes_, bytes); }

  /// Sends a batch, or queues it; it must exist until it is answered or the session ends.
  void send(EngineBatch& batch);

  /// Waits until a batch, or a part of it, is answered. Throws ConnectionLost, and EngineError if no answer arrives in
  /// time.
  void wait_for(std::span<const EngineRequest> batch);

  /// Sends commands and waits for their answers.
  EngineBatch ask(std::vector<std::string> commands);

 private:
  void require_greeting(SteadyTime deadline);
  void send_waiting();
  bool take(std::string& message);

  const UnrealcvOptions& options_;
  MessageConnection connection_;
  std::size_t max_bytes_ = std::size_t{1} << 27;  // maximum of a message
  std::string message_;
  std::uint32_t last_id_ = 0;
  std::deque<EngineRequest*> waiting_;               // to be sent
  std::map<std::uint32_t, EngineRequest*> pending_;  // sent, without answer
};

}  // namespace esim::inline backends::inline unrealcv
